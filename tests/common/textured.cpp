#include "textured.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

#include <tiny_gltf.h>

namespace
{

// The elements of an accessor, which must lie side by side. at() and the lengths turn nonsense into an error.
template <typename T>
T *elements(const tinygltf::Model &gltf, int index, int type, int component_type, size_t *count)
{
    const tinygltf::Accessor &accessor = gltf.accessors.at((size_t)index);
    const tinygltf::BufferView &view = gltf.bufferViews.at((size_t)accessor.bufferView);
    const std::vector<unsigned char> &data = gltf.buffers.at((size_t)view.buffer).data;
    const size_t width = (size_t)tinygltf::GetNumComponentsInType((uint32_t)type);
    const size_t bytes = accessor.count * width * sizeof(T), first = view.byteOffset + accessor.byteOffset;
    if (accessor.type != type || accessor.componentType != component_type || view.byteStride != 0 ||
        bytes == 0 || accessor.byteOffset + bytes > view.byteLength || first + bytes > data.size())
    {
        throw std::runtime_error("accessor " + std::to_string(index) + " is not what it should be");
    }
    T *const out = (T *)std::malloc(bytes);
    if (!out)
    {
        throw std::bad_alloc();
    }
    std::memcpy(out, data.data() + first, bytes);
    *count = accessor.count;
    return out;
}

void take_mesh(const tinygltf::Model &gltf, const tinygltf::Primitive &primitive, textured *out)
{
    const int real = TINYGLTF_COMPONENT_TYPE_FLOAT;
    size_t normals, coordinates, corners;
    out->positions = elements<float>(gltf, primitive.attributes.at("POSITION"), TINYGLTF_TYPE_VEC3, real,
                                     &out->vertex_count);
    out->normals = elements<float>(gltf, primitive.attributes.at("NORMAL"), TINYGLTF_TYPE_VEC3, real, &normals);
    out->uv = elements<float>(gltf, primitive.attributes.at("TEXCOORD_0"), TINYGLTF_TYPE_VEC2, real, &coordinates);
    out->triangles = elements<uint32_t>(gltf, primitive.indices, TINYGLTF_TYPE_SCALAR,
                                        TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, &corners);
    out->triangle_count = corners / 3;
    if (normals != out->vertex_count || coordinates != out->vertex_count || corners % 3 != 0)
    {
        throw std::runtime_error("attributes differ in length");
    }
    for (size_t i = 0; i < corners; ++i)
    {
        if (out->triangles[i] >= out->vertex_count)
        {
            throw std::runtime_error("an index is out of range");
        }
    }
}

void take_texture(const tinygltf::Model &gltf, const tinygltf::Material &material, textured *out)
{
    const tinygltf::TextureInfo &info = material.pbrMetallicRoughness.baseColorTexture;
    const tinygltf::Texture &texture = gltf.textures.at((size_t)info.index);
    const tinygltf::Image &image = gltf.images.at((size_t)texture.source);
    const tinygltf::Sampler &sampler = gltf.samplers.at((size_t)texture.sampler);
    const size_t pixels = (size_t)image.width * (size_t)image.height, channels = (size_t)image.component;
    if (info.texCoord != 0 || image.bits != 8 || channels < 3 || image.image.size() != channels * pixels || pixels == 0)
    {
        throw std::runtime_error("the picture is not what it should be");
    }
    out->rgb = (unsigned char *)std::malloc(3 * pixels);
    if (!out->rgb)
    {
        throw std::bad_alloc();
    }
    for (size_t i = 0; i < pixels; ++i)
    {
        std::memcpy(out->rgb + 3 * i, &image.image[channels * i], 3);
    }
    out->width = image.width;
    out->height = image.height;
    out->clamped = sampler.wrapS == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE &&
                   sampler.wrapT == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    out->unlit = material.extensions.count("KHR_materials_unlit") > 0;
    out->white = material.extras.Has("white") ? material.extras.Get("white").GetNumberAsDouble() : std::nan("");
}

double linear(unsigned char srgb) // IEC 61966-2-1
{
    const double s = srgb / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

} // namespace

extern "C" int textured_load(const char *path, textured *out, char *error_text, size_t error_size)
{
    std::memset(out, 0, sizeof *out);
    try
    {
        tinygltf::Model gltf;
        std::string error, warning;
        if (!tinygltf::TinyGLTF().LoadBinaryFromFile(&gltf, &error, &warning, path) || !error.empty())
        {
            throw std::runtime_error(error);
        }
        const tinygltf::Primitive &primitive = gltf.meshes.at(0).primitives.at(0);
        take_mesh(gltf, primitive, out);
        take_texture(gltf, gltf.materials.at((size_t)primitive.material), out);
        return 0;
    }
    catch (const std::exception &e)
    {
        std::snprintf(error_text, error_size, "%s: %s", path, e.what());
        textured_free(out);
        return -1;
    }
}

extern "C" void textured_free(textured *t)
{
    std::free(t->positions);
    std::free(t->normals);
    std::free(t->uv);
    std::free(t->triangles);
    std::free(t->rgb);
    std::memset(t, 0, sizeof *t);
}

extern "C" void textured_fetch(const textured *t, double u, double v, double out[3])
{
    const double x = u * t->width - 0.5, y = v * t->height - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    out[0] = out[1] = out[2] = 0.0;
    for (int i = 0; i < 4; ++i)
    {
        const double share = (i % 2 ? x - left : 1.0 - x + left) * (i / 2 ? y - top : 1.0 - y + top);
        const double column = std::fmin(t->width - 1.0, std::fmax(0.0, left + i % 2));
        const double row = std::fmin(t->height - 1.0, std::fmax(0.0, top + i / 2));
        const unsigned char *const texel = t->rgb + 3 * ((size_t)row * (size_t)t->width + (size_t)column);
        for (int k = 0; k < 3; ++k)
        {
            out[k] += share * linear(texel[k]);
        }
    }
}
