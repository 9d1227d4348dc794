// Exact diffuse reflectances of half spaces, against which the dipole's total is wrong by a known amount.

#ifndef SSS_TESTS_HALF_SPACES_H
#define SSS_TESTS_HALF_SPACES_H

typedef struct exact_half_space
{
    double alpha, n, exact, error_percent; // exact = Rd/(1 - F0)
} exact_half_space;

enum
{
    COUNT_OF_HALF_SPACES = 33
};

// Shared TRUTH.md 1.2: isotropic scattering, smooth boundary, light along the normal; Chandrasekhar's H-function with
// Fresnel feedback, checked against adding-doubling and Giovanelli 1955.
static const exact_half_space half_spaces[COUNT_OF_HALF_SPACES] = {
    {.1, 1, .016390, -34.42},    {.3, 1, .057214, -29.53},    {.5, 1, .115226, -23.80},   {.7, 1, .208680, -16.72},
    {.8, 1, .285255, -12.36},    {.9, 1, .414947, -7.08},     {.95, 1, .535541, -3.86},   {.98, 1, .671084, -1.62},
    {.99, 1, .752721, -.80},     {.995, 1, .817047, -.37},    {.999, 1, .912845, -.04},   {.1, 1.3, .008223, 17.97},
    {.3, 1.3, .029871, 18.67},   {.5, 1.3, .063486, 17.37},   {.7, 1.3, .124681, 12.76},  {.8, 1.3, .181324, 8.61},
    {.9, 1.3, .290729, 2.91},    {.95, 1.3, .407815, -.28},   {.98, 1.3, .557303, -1.74}, {.99, 1.3, .656564, -1.82},
    {.995, 1.3, .739697, -1.58}, {.999, 1.3, .871583, -.87},  {.1, 1.5, .005843, 65.50},  {.3, 1.5, .021406, 64.59},
    {.5, 1.5, .046089, 59.63},   {.7, 1.5, .092610, 47.34},   {.8, 1.5, .137478, 36.36},  {.9, 1.5, .229082, 19.92},
    {.95, 1.5, .334498, 8.91},   {.98, 1.5, .480701, 1.72},   {.99, 1.5, .585397, -.36},  {.995, 1.5, .678038, -1.05},
    {.999, 1.5, .834853, -.92}};

#endif
