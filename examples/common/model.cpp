#include "model.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <limits>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <sys/stat.h>

#include <tiny_gltf.h>


namespace
{

typedef std::runtime_error failure;

// Scenes above these sizes are refused: instancing lets a small file ask for any amount of memory.
const size_t MAX_VERTICES = size_t(1) << 26;
const size_t MAX_TRIANGLES = size_t(1) << 27;
// tinygltf walks nested JSON by recursion; a valid scene is a handful of levels deep.
const int MAX_JSON_DEPTH = 128;
// A container holds its sizes in 32 bits.
const unsigned long long MAX_FILE_BYTES = 0xffffffffull;

// ---- bytes ----

std::vector<unsigned char> read_file(const std::string &path)
{
    struct stat status;
    if (stat(path.c_str(), &status) != 0)
    {
        throw failure("cannot open " + path + ": " + std::strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) // a pipe or a device could block or never end
    {
        throw failure(path + " is not a regular file");
    }
    if (status.st_size < 1 || (unsigned long long)status.st_size > MAX_FILE_BYTES)
    {
        throw failure(path + (status.st_size < 1 ? " is empty" : " is larger than 4 GiB"));
    }
    std::vector<unsigned char> bytes((size_t)status.st_size);
    std::FILE *const file = std::fopen(path.c_str(), "rb");
    if (!file)
    {
        throw failure("cannot open " + path + ": " + std::strerror(errno));
    }
    const size_t got = std::fread(bytes.data(), 1, bytes.size(), file);
    std::fclose(file);
    if (got != bytes.size())
    {
        throw failure("cannot read " + path);
    }
    return bytes;
}

uint32_t little_endian_32(const unsigned char *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

bool is_binary(const std::vector<unsigned char> &bytes)
{
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
}

// The JSON text of a file, [begin, end). tinygltf 2.7 reads up to eight bytes past a container whose second
// chunk claims them, so the chunks are checked here.
void find_json(const std::vector<unsigned char> &bytes, size_t *begin, size_t *end)
{
    *begin = 0;
    *end = bytes.size();
    if (!is_binary(bytes))
    {
        return;
    }
    if (bytes.size() < 20 || little_endian_32(&bytes[4]) != 2)
    {
        throw failure("a binary glTF that is truncated or not of version 2");
    }
    const uint64_t length = little_endian_32(&bytes[8]);
    const uint64_t json_length = little_endian_32(&bytes[12]);
    if (length > bytes.size() || 20 + json_length > length || std::memcmp(&bytes[16], "JSON", 4) != 0)
    {
        throw failure("a binary glTF whose header does not fit its size: truncated?");
    }
    const size_t binary = (size_t)(20 + json_length);
    if (binary != length && (binary + 8 > length || binary + 8 + little_endian_32(&bytes[binary]) > length))
    {
        throw failure("a binary glTF whose binary chunk does not fit its size: truncated?");
    }
    *begin = 20;
    *end = binary;
}

void check_json_depth(const std::vector<unsigned char> &bytes, size_t begin, size_t end)
{
    int depth = 0;
    bool in_string = false;
    for (size_t i = begin; i < end; ++i)
    {
        const unsigned char c = bytes[i];
        if (in_string)
        {
            i += c == '\\'; // skips what is escaped
            in_string = c != '"';
        }
        else if (c == '"')
        {
            in_string = true;
        }
        else if (c == '{' || c == '[')
        {
            if (++depth > MAX_JSON_DEPTH)
            {
                throw failure("JSON nested deeper than any glTF");
            }
        }
        else if (c == '}' || c == ']')
        {
            --depth;
        }
    }
}

// ---- tinygltf ----

bool no_image(tinygltf::Image *, const int, std::string *, std::string *, int, int, const unsigned char *, int, void *)
{
    return true; // textures play no part
}

bool ends_with(const std::string &text, const char *end)
{
    const size_t length = std::strlen(end);
    return text.size() >= length && text.compare(text.size() - length, length, end) == 0;
}

bool file_exists(const std::string &path, void *)
{
    static const char *const pictures[] = {".png", ".jpg", ".jpeg", ".webp", ".ktx2", ".dds", ".PNG", ".JPG"};
    for (const char *picture : pictures)
    {
        if (ends_with(path, picture))
        {
            return false; // not needed, so not looked for
        }
    }
    struct stat status;
    return stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode);
}

bool read_whole_file(std::vector<unsigned char> *out, std::string *error, const std::string &path, void *)
{
    try
    {
        *out = read_file(path);
        return true;
    }
    catch (const std::exception &e)
    {
        *error += e.what();
        return false;
    }
}

// Extensions that leave positions, normals and indices as they are.
bool is_harmless(const std::string &extension)
{
    static const char *const starts[] = {"KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_",
                                         "KHR_mesh_quantization", "KHR_animation_", "KHR_xmp"};
    for (const char *start : starts)
    {
        if (extension.compare(0, std::strlen(start), start) == 0)
        {
            return true;
        }
    }
    return false;
}

std::string first_line(const std::string &text)
{
    return text.substr(0, text.find('\n'));
}

void parse(const std::string &path, tinygltf::Model *gltf)
{
    const std::vector<unsigned char> bytes = read_file(path);
    size_t begin, end;
    find_json(bytes, &begin, &end);
    check_json_depth(bytes, begin, end);

    tinygltf::TinyGLTF loader;
    loader.SetImageLoader(no_image, nullptr);
    const tinygltf::FsCallbacks callbacks = {file_exists, tinygltf::ExpandFilePath, read_whole_file, nullptr, nullptr};
    loader.SetFsCallbacks(callbacks);
    const size_t slash = path.find_last_of('/');
    const std::string folder = slash == std::string::npos ? "" : path.substr(0, slash + 1);
    std::string error, warning;
    const bool parsed =
        is_binary(bytes)
            ? loader.LoadBinaryFromMemory(gltf, &error, &warning, bytes.data(), (unsigned)bytes.size(), folder)
            : loader.LoadASCIIFromString(gltf, &error, &warning, (const char *)bytes.data(), (unsigned)bytes.size(),
                                         folder);
    const std::string json((const char *)&bytes[begin], end - begin);
    for (const char *compression : {"KHR_draco_mesh_compression", "EXT_meshopt_compression"})
    {
        if (json.find(compression) != std::string::npos)
        {
            throw failure(std::string("the mesh is compressed with ") + compression +
                          ", which is not supported: convert it without");
        }
    }
    if (!parsed)
    {
        throw failure("not a valid glTF: " + (error.empty() ? "unreadable JSON" : first_line(error)));
    }
    for (const std::string &extension : gltf->extensionsRequired)
    {
        if (!is_harmless(extension))
        {
            throw failure("the file needs the extension " + extension + ", which is not supported");
        }
    }
}

// ---- accessors ----

std::string quoted(const char *what, long long index)
{
    return std::string(what) + " " + std::to_string(index);
}

size_t component_bytes(int type)
{
    switch (type)
    {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return 2;
    case TINYGLTF_COMPONENT_TYPE_INT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT: return 4;
    case TINYGLTF_COMPONENT_TYPE_DOUBLE: return 8;
    default: throw failure("an accessor has an unknown component type");
    }
}

template <typename T> double load(const unsigned char *p)
{
    T value;
    std::memcpy(&value, p, sizeof value); // glTF is little-endian, and so is every machine this runs on
    return (double)value;
}

// glTF 2.0, section 3.6.2.2: normalised integers.
double component(const unsigned char *p, int type, bool normalized)
{
    switch (type)
    {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
        return normalized ? std::fmax(load<int8_t>(p) / 127.0, -1.0) : load<int8_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return load<uint8_t>(p) / (normalized ? 255.0 : 1.0);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
        return normalized ? std::fmax(load<int16_t>(p) / 32767.0, -1.0) : load<int16_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return load<uint16_t>(p) / (normalized ? 65535.0 : 1.0);
    case TINYGLTF_COMPONENT_TYPE_INT: return load<int32_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return load<uint32_t>(p);
    case TINYGLTF_COMPONENT_TYPE_FLOAT: return load<float>(p);
    default: return load<double>(p);
    }
}

// A run of `count` elements in a buffer view, every byte of which exists.
struct span
{
    const unsigned char *bytes;
    size_t stride;
};

span checked_span(const tinygltf::Model &gltf, int view_index, size_t offset, size_t count, size_t element)
{
    if (view_index < 0 || (size_t)view_index >= gltf.bufferViews.size())
    {
        throw failure(quoted("there is no buffer view", view_index));
    }
    const tinygltf::BufferView &view = gltf.bufferViews[(size_t)view_index];
    if (view.buffer < 0 || (size_t)view.buffer >= gltf.buffers.size())
    {
        throw failure(quoted("there is no buffer", view.buffer));
    }
    const std::vector<unsigned char> &data = gltf.buffers[(size_t)view.buffer].data;
    if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
    {
        throw failure(quoted("too large for its buffer is buffer view", view_index));
    }
    const size_t stride = view.byteStride ? view.byteStride : element;
    if (stride < element)
    {
        throw failure(quoted("elements overlap in buffer view", view_index));
    }
    // offset + (count - 1) stride + element <= byteLength, written so that nothing overflows
    if (count > 0 && (offset > view.byteLength || element > view.byteLength - offset ||
                      (view.byteLength - offset - element) / stride < count - 1))
    {
        throw failure("an accessor runs past the end of its buffer view");
    }
    const span result = {data.data() + view.byteOffset + offset, stride};
    return result;
}

// Adds what a sparse accessor replaces.
void replace_sparse(const tinygltf::Model &gltf, const tinygltf::Accessor &accessor, size_t width,
                    std::vector<double> *out)
{
    const int index_type = accessor.sparse.indices.componentType;
    if (accessor.sparse.count < 1 || (size_t)accessor.sparse.count > accessor.count ||
        accessor.sparse.indices.byteOffset < 0 || accessor.sparse.values.byteOffset < 0)
    {
        throw failure("a sparse accessor has bad counts or offsets");
    }
    const size_t count = (size_t)accessor.sparse.count;
    const size_t bytes = component_bytes(accessor.componentType);
    const span indices = checked_span(gltf, accessor.sparse.indices.bufferView,
                                      (size_t)accessor.sparse.indices.byteOffset, count, component_bytes(index_type));
    const span values = checked_span(gltf, accessor.sparse.values.bufferView,
                                     (size_t)accessor.sparse.values.byteOffset, count, width * bytes);
    for (size_t i = 0; i < count; ++i)
    {
        const double target = component(indices.bytes + i * indices.stride, index_type, false);
        if (!(target >= 0.0 && target < (double)accessor.count))
        {
            throw failure("a sparse accessor replaces an element that does not exist");
        }
        for (size_t k = 0; k < width; ++k)
        {
            (*out)[width * (size_t)target + k] = component(values.bytes + i * values.stride + k * bytes,
                                                           accessor.componentType, accessor.normalized);
        }
    }
}

// Any accessor as doubles, `width` components an element.
std::vector<double> read_accessor(const tinygltf::Model &gltf, int index, int type, size_t width, size_t limit)
{
    if (index < 0 || (size_t)index >= gltf.accessors.size())
    {
        throw failure(quoted("there is no accessor", index));
    }
    const tinygltf::Accessor &accessor = gltf.accessors[(size_t)index];
    if (accessor.type != type)
    {
        throw failure(quoted("the wrong number of components has accessor", index));
    }
    if (accessor.count > limit)
    {
        throw failure(quoted("more elements than this program takes has accessor", index));
    }
    const size_t bytes = component_bytes(accessor.componentType);
    std::vector<double> out;
    if (accessor.bufferView >= 0)
    {
        const span elements = checked_span(gltf, accessor.bufferView, accessor.byteOffset, accessor.count,
                                           width * bytes);
        out.reserve(width * accessor.count);
        for (size_t i = 0; i < accessor.count; ++i)
        {
            for (size_t k = 0; k < width; ++k)
            {
                out.push_back(component(elements.bytes + i * elements.stride + k * bytes, accessor.componentType,
                                        accessor.normalized));
            }
        }
    }
    else
    {
        out.assign(width * accessor.count, 0.0); // glTF 2.0, 3.6.2.3: without a buffer view all are zero
    }
    if (accessor.sparse.isSparse)
    {
        replace_sparse(gltf, accessor, width, &out);
    }
    return out;
}

// ---- transforms: columns first, as in glTF ----

struct matrix
{
    double m[16];
};

matrix product(const matrix &a, const matrix &b)
{
    matrix c;
    for (int column = 0; column < 4; ++column)
    {
        for (int row = 0; row < 4; ++row)
        {
            c.m[4 * column + row] = 0.0;
            for (int k = 0; k < 4; ++k)
            {
                c.m[4 * column + row] += a.m[4 * k + row] * b.m[4 * column + k];
            }
        }
    }
    return c;
}

matrix identity()
{
    const matrix unit = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    return unit;
}

matrix from_translation_rotation_scale(const tinygltf::Node &node)
{
    const double zero[3] = {0, 0, 0}, one[3] = {1, 1, 1}, no_turn[4] = {0, 0, 0, 1};
    const double *const t = node.translation.size() == 3 ? node.translation.data() : zero;
    const double *const s = node.scale.size() == 3 ? node.scale.data() : one;
    const double *const q = node.rotation.size() == 4 ? node.rotation.data() : no_turn;
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double n = length > 0.0 ? 1.0 / length : 0.0; // quantised rotations are not quite of unit length
    const double x = q[0] * n, y = q[1] * n, z = q[2] * n, w = length > 0.0 ? q[3] * n : 1.0;
    const matrix result = {{s[0] * (1 - 2 * (y * y + z * z)), s[0] * 2 * (x * y + z * w), s[0] * 2 * (x * z - y * w), 0,
                            s[1] * 2 * (x * y - z * w), s[1] * (1 - 2 * (x * x + z * z)), s[1] * 2 * (y * z + x * w), 0,
                            s[2] * 2 * (x * z + y * w), s[2] * 2 * (y * z - x * w), s[2] * (1 - 2 * (x * x + y * y)), 0,
                            t[0], t[1], t[2], 1}};
    return result;
}

matrix node_matrix(const tinygltf::Node &node)
{
    if (node.matrix.size() != 16)
    {
        return from_translation_rotation_scale(node);
    }
    matrix result;
    std::memcpy(result.m, node.matrix.data(), sizeof result.m);
    return result;
}

// The cofactors of the linear part turn normals, up to the sign of its determinant, also where it is singular.
void cofactors(const matrix &a, double c[9], double *determinant)
{
    const double *const m = a.m;
    for (int column = 0; column < 3; ++column)
    {
        const double *const p = m + 4 * ((column + 1) % 3), *const q = m + 4 * ((column + 2) % 3);
        c[3 * column + 0] = p[1] * q[2] - p[2] * q[1];
        c[3 * column + 1] = p[2] * q[0] - p[0] * q[2];
        c[3 * column + 2] = p[0] * q[1] - p[1] * q[0];
    }
    *determinant = m[0] * c[0] + m[1] * c[1] + m[2] * c[2];
}

// ---- from nodes to one mesh ----

struct builder
{
    const tinygltf::Model &gltf;
    std::vector<float> positions, normals;
    std::vector<uint32_t> triangles;
};

void append_vertices(builder *b, int position_accessor, int normal_accessor, const matrix &world)
{
    const size_t room = MAX_VERTICES - b->positions.size() / 3;
    const std::vector<double> p = read_accessor(b->gltf, position_accessor, TINYGLTF_TYPE_VEC3, 3, room);
    std::vector<double> n;
    if (normal_accessor >= 0)
    {
        n = read_accessor(b->gltf, normal_accessor, TINYGLTF_TYPE_VEC3, 3, room);
        if (n.size() != p.size())
        {
            throw failure("a primitive has more or fewer normals than positions");
        }
    }
    double c[9], determinant;
    cofactors(world, c, &determinant);
    const double sign = determinant < 0.0 ? -1.0 : 1.0;
    for (size_t i = 0; i < p.size(); i += 3)
    {
        for (size_t k = 0; k < 3; ++k)
        {
            const double *const m = world.m;
            const double x = m[k] * p[i] + m[4 + k] * p[i + 1] + m[8 + k] * p[i + 2] + m[12 + k];
            if (!(std::fabs(x) <= (double)std::numeric_limits<float>::max()))
            {
                throw failure("a vertex position is not a finite number");
            }
            b->positions.push_back((float)x);
        }
        double turned[3] = {0, 0, 0};
        for (size_t k = 0; k < 3 && !n.empty(); ++k)
        {
            turned[k] = sign * (c[k] * n[i] + c[3 + k] * n[i + 1] + c[6 + k] * n[i + 2]);
        }
        const double length = std::sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2]);
        const bool usable = length > 0.0 && length <= std::numeric_limits<double>::max();
        for (size_t k = 0; k < 3; ++k)
        {
            b->normals.push_back(usable ? (float)(turned[k] / length) : 0.0f); // zero: to be computed
        }
    }
}

std::vector<uint32_t> read_indices(const builder &b, int accessor, size_t first, size_t vertex_count)
{
    std::vector<uint32_t> corners;
    if (accessor < 0)
    {
        corners.resize(vertex_count);
        for (size_t i = 0; i < vertex_count; ++i)
        {
            corners[i] = (uint32_t)(first + i);
        }
        return corners;
    }
    const std::vector<double> indices = read_accessor(b.gltf, accessor, TINYGLTF_TYPE_SCALAR, 1, 3 * MAX_TRIANGLES);
    corners.reserve(indices.size());
    for (const double index : indices)
    {
        if (!(index >= 0.0 && index < (double)vertex_count))
        {
            throw failure("a triangle names a vertex that does not exist");
        }
        corners.push_back((uint32_t)(first + (size_t)index));
    }
    return corners;
}

void append_triangles(builder *b, const std::vector<uint32_t> &corners, int mode, bool mirrored)
{
    const bool list = mode == TINYGLTF_MODE_TRIANGLES, fan = mode == TINYGLTF_MODE_TRIANGLE_FAN;
    const size_t count = list ? corners.size() / 3 : corners.size() < 3 ? 0 : corners.size() - 2;
    if (count > MAX_TRIANGLES - b->triangles.size() / 3)
    {
        throw failure("the scene has more triangles than this program takes");
    }
    for (size_t i = 0; i < count; ++i)
    {
        // glTF 2.0, 3.7.2.1: the corners of the i-th triangle of a list, a fan and a strip
        uint32_t t[3];
        t[0] = corners[list ? 3 * i : fan ? i + 1 : i];
        t[1] = corners[list ? 3 * i + 1 : fan ? i + 2 : i + 1 + i % 2];
        t[2] = corners[list ? 3 * i + 2 : fan ? 0 : i + 2 - i % 2];
        b->triangles.push_back(t[0]);
        b->triangles.push_back(t[mirrored ? 2 : 1]);
        b->triangles.push_back(t[mirrored ? 1 : 2]);
    }
}

int attribute(const tinygltf::Primitive &primitive, const char *name)
{
    const std::map<std::string, int>::const_iterator found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? -1 : found->second;
}

bool is_triangles(int mode)
{
    return mode == TINYGLTF_MODE_TRIANGLES || mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
           mode == TINYGLTF_MODE_TRIANGLE_FAN;
}

void append_mesh(builder *b, const tinygltf::Mesh &mesh, const matrix &world)
{
    struct range
    {
        size_t first, count;
    };
    std::map<std::pair<int, int>, range> shared; // vertices of this mesh by their accessors
    double c[9], determinant;
    cofactors(world, c, &determinant);
    for (const tinygltf::Primitive &primitive : mesh.primitives)
    {
        const int position = attribute(primitive, "POSITION"), normal = attribute(primitive, "NORMAL");
        const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
        if (position < 0 || !is_triangles(mode)) // points and lines have no area to scatter from
        {
            continue;
        }
        const std::pair<int, int> key(position, normal);
        if (shared.find(key) == shared.end())
        {
            const size_t first = b->positions.size() / 3;
            append_vertices(b, position, normal, world);
            const range added = {first, b->positions.size() / 3 - first};
            shared[key] = added;
        }
        append_triangles(b, read_indices(*b, primitive.indices, shared[key].first, shared[key].count), mode,
                         determinant < 0.0);
    }
}

// The nodes at which the walk starts: of the default scene, else of the first, else every node without a parent.
std::vector<int> root_nodes(const tinygltf::Model &gltf)
{
    if (!gltf.scenes.empty())
    {
        const size_t scene = gltf.defaultScene < 0 ? 0 : (size_t)gltf.defaultScene;
        if (scene >= gltf.scenes.size())
        {
            throw failure(quoted("there is no scene", gltf.defaultScene));
        }
        return gltf.scenes[scene].nodes;
    }
    std::vector<bool> is_child(gltf.nodes.size(), false);
    for (const tinygltf::Node &node : gltf.nodes)
    {
        for (const int child : node.children)
        {
            if (child >= 0 && (size_t)child < is_child.size())
            {
                is_child[(size_t)child] = true;
            }
        }
    }
    std::vector<int> roots;
    for (size_t i = 0; i < is_child.size(); ++i)
    {
        if (!is_child[i])
        {
            roots.push_back((int)i);
        }
    }
    return roots;
}

void walk_nodes(builder *b)
{
    struct visit
    {
        int node;
        matrix parent;
    };
    const tinygltf::Model &gltf = b->gltf;
    std::vector<bool> seen(gltf.nodes.size(), false);
    std::vector<visit> stack;
    const std::vector<int> roots = root_nodes(gltf);
    for (size_t i = roots.size(); i-- > 0;)
    {
        const visit root = {roots[i], identity()};
        stack.push_back(root);
    }
    while (!stack.empty())
    {
        const visit now = stack.back();
        stack.pop_back();
        if (now.node < 0 || (size_t)now.node >= gltf.nodes.size())
        {
            throw failure(quoted("there is no node", now.node));
        }
        if (seen[(size_t)now.node]) // glTF 2.0, 3.5.2: strict trees
        {
            throw failure(quoted("reached twice, so that the scene is no tree, is node", now.node));
        }
        seen[(size_t)now.node] = true;
        const tinygltf::Node &node = gltf.nodes[(size_t)now.node];
        const matrix world = product(now.parent, node_matrix(node));
        if (node.mesh >= (int)gltf.meshes.size())
        {
            throw failure(quoted("there is no mesh", node.mesh));
        }
        if (node.mesh >= 0)
        {
            append_mesh(b, gltf.meshes[(size_t)node.mesh], world);
        }
        for (size_t i = node.children.size(); i-- > 0;)
        {
            const visit child = {node.children[i], world};
            stack.push_back(child);
        }
    }
}

void fill_missing_normals(builder *b)
{
    const size_t count = b->positions.size() / 3;
    bool missing = false;
    for (size_t i = 0; i < count && !missing; ++i)
    {
        missing = b->normals[3 * i] == 0.0f && b->normals[3 * i + 1] == 0.0f && b->normals[3 * i + 2] == 0.0f;
    }
    if (!missing)
    {
        return;
    }
    sss_mesh mesh = {};
    mesh.positions = b->positions.data();
    mesh.triangles = b->triangles.data();
    mesh.vertex_count = count;
    mesh.triangle_count = b->triangles.size() / 3;
    mesh.mm_per_unit = 1.0;
    std::vector<float> computed(3 * count);
    const sss_result result = sss_dipole_vertex_normals(&mesh, computed.data());
    if (result != SSS_OK)
    {
        throw failure(std::string("computing normals: ") + sss_result_string(result));
    }
    for (size_t i = 0; i < 3 * count; i += 3)
    {
        float *const n = &b->normals[i];
        if (n[0] == 0.0f && n[1] == 0.0f && n[2] == 0.0f)
        {
            std::memcpy(n, &computed[i], 3 * sizeof *n);
        }
    }
}

// ---- inside out or not ----

// About a point near the middle, so that a surface that is not quite closed still tells its orientation.
double signed_volume(const builder &b)
{
    const std::vector<float> &p = b.positions;
    double middle[3] = {0, 0, 0}, sum = 0.0;
    for (size_t i = 0; i < p.size(); ++i)
    {
        middle[i % 3] += (double)p[i] / ((double)p.size() / 3.0);
    }
    for (size_t t = 0; t < b.triangles.size(); t += 3)
    {
        double c[3][3];
        for (size_t i = 0; i < 9; ++i)
        {
            c[i / 3][i % 3] = (double)p[3 * (size_t)b.triangles[t + i / 3] + i % 3] - middle[i % 3];
        }
        sum += c[0][0] * (c[1][1] * c[2][2] - c[1][2] * c[2][1]) + c[0][1] * (c[1][2] * c[2][0] - c[1][0] * c[2][2]) +
               c[0][2] * (c[1][0] * c[2][1] - c[1][1] * c[2][0]);
    }
    return sum / 6.0;
}

// Vertices at one place count as one: exporters split them along seams.
std::vector<uint32_t> merged_vertices(const std::vector<float> &positions)
{
    std::vector<uint32_t> order(positions.size() / 3), merged(order.size());
    for (size_t i = 0; i < order.size(); ++i)
    {
        order[i] = (uint32_t)i;
    }
    const float *const p = positions.data();
    std::sort(order.begin(), order.end(), [p](uint32_t a, uint32_t b)
              { return std::lexicographical_compare(p + 3 * (size_t)a, p + 3 * (size_t)a + 3, p + 3 * (size_t)b,
                                                    p + 3 * (size_t)b + 3); });
    for (size_t i = 0; i < order.size(); ++i)
    {
        const bool same = i > 0 && std::equal(p + 3 * (size_t)order[i], p + 3 * (size_t)order[i] + 3,
                                              p + 3 * (size_t)order[i - 1]);
        merged[order[i]] = same ? merged[order[i - 1]] : order[i];
    }
    return merged;
}

// The share of edges that no neighbour runs along the other way.
double open_share(const builder &b)
{
    const std::vector<uint32_t> merged = merged_vertices(b.positions);
    std::vector<uint64_t> edges;
    edges.reserve(b.triangles.size());
    for (size_t i = 0; i < b.triangles.size(); ++i)
    {
        const uint64_t from = merged[b.triangles[i]], to = merged[b.triangles[i % 3 == 2 ? i - 2 : i + 1]];
        edges.push_back(from << 32 | to);
    }
    std::sort(edges.begin(), edges.end());
    size_t open = 0;
    for (const uint64_t edge : edges)
    {
        open += std::binary_search(edges.begin(), edges.end(), edge << 32 | edge >> 32) ? 0 : 1;
    }
    return (double)open / (double)edges.size();
}

// Some files wind all triangles clockwise, against the standard: such an object would be lit from inside. Turns it
// round where there is no doubt: its volume is negative, and at most one edge in fifty is open.
bool turn_outward(builder *b)
{
    if (signed_volume(*b) >= 0.0 || open_share(*b) > 0.02)
    {
        return false;
    }
    for (size_t t = 0; t < b->triangles.size(); t += 3)
    {
        std::swap(b->triangles[t + 1], b->triangles[t + 2]);
    }
    return true;
}

// The file's normals, where they agreed with the windings before those were turned.
void turn_normals(builder *b)
{
    double along = 0.0;
    for (size_t t = 0; t < b->triangles.size(); t += 3)
    {
        const float *corner[3], *normal[3];
        for (size_t i = 0; i < 3; ++i)
        {
            corner[i] = &b->positions[3 * (size_t)b->triangles[t + i]];
            normal[i] = &b->normals[3 * (size_t)b->triangles[t + i]];
        }
        for (size_t k = 0; k < 3; ++k)
        {
            const size_t l = (k + 1) % 3, m = (k + 2) % 3;
            const double n = ((double)corner[1][l] - corner[0][l]) * ((double)corner[2][m] - corner[0][m]) -
                             ((double)corner[1][m] - corner[0][m]) * ((double)corner[2][l] - corner[0][l]);
            along += n * ((double)normal[0][k] + (double)normal[1][k] + (double)normal[2][k]);
        }
    }
    for (size_t i = 0; i < b->normals.size() && along < 0.0; ++i)
    {
        b->normals[i] = -b->normals[i];
    }
}

template <typename T> T *copied(const std::vector<T> &values)
{
    T *const copy = (T *)std::malloc(values.size() * sizeof(T));
    if (!copy)
    {
        throw std::bad_alloc();
    }
    std::memcpy(copy, values.data(), values.size() * sizeof(T));
    return copy;
}

void load_model(const char *path, model *out)
{
    tinygltf::Model gltf;
    parse(path, &gltf);
    builder b = {gltf, {}, {}, {}};
    walk_nodes(&b);
    if (b.triangles.empty())
    {
        throw failure("the scene has no triangles");
    }
    out->turned = turn_outward(&b);
    if (out->turned)
    {
        turn_normals(&b);
    }
    fill_missing_normals(&b);
    out->positions = copied(b.positions);
    out->normals = copied(b.normals);
    out->triangles = copied(b.triangles);
    out->vertex_count = b.positions.size() / 3;
    out->triangle_count = b.triangles.size() / 3;
}

// Runs f, and turns whatever it throws into a text.
template <typename F> int guarded(const char *path, char *error_text, size_t error_size, F f)
{
    std::string reason;
    try
    {
        f();
        return 0;
    }
    catch (const std::bad_alloc &)
    {
        reason = "out of memory";
    }
    catch (const std::length_error &)
    {
        reason = "a size in the file is absurd";
    }
    catch (const std::exception &e)
    {
        reason = e.what();
    }
    if (error_text && error_size > 0)
    {
        const bool named = reason.find(path) != std::string::npos;
        std::snprintf(error_text, error_size, "%s%s%s", named ? "" : path, named ? "" : ": ", reason.c_str());
    }
    return -1;
}

// ---- writing ----

template <typename T>
int add_accessor(tinygltf::Model *gltf, const T *values, size_t count, int type, int component_type, int target)
{
    std::vector<unsigned char> &data = gltf->buffers[0].data;
    const size_t bytes = count * (size_t)tinygltf::GetNumComponentsInType((uint32_t)type) * sizeof(T);
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data.size();
    view.byteLength = bytes;
    view.target = target;
    data.insert(data.end(), (const unsigned char *)values, (const unsigned char *)values + bytes);
    gltf->bufferViews.push_back(view);
    tinygltf::Accessor accessor;
    accessor.bufferView = (int)gltf->bufferViews.size() - 1;
    accessor.count = count;
    accessor.type = type;
    accessor.componentType = component_type;
    gltf->accessors.push_back(accessor);
    return (int)gltf->accessors.size() - 1;
}

tinygltf::Material unlit_material(tinygltf::Model *gltf)
{
    tinygltf::Material material;
    material.name = "radiosity";
    material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object());
    gltf->extensionsUsed.push_back("KHR_materials_unlit");
    return material;
}

tinygltf::Model new_model()
{
    tinygltf::Model gltf;
    gltf.asset.version = "2.0";
    gltf.asset.generator = "sss_dipole bake";
    gltf.buffers.resize(1);
    return gltf;
}

int add_vertices(tinygltf::Model *gltf, const float *values, size_t count, int type)
{
    return add_accessor(gltf, values, count, type, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TARGET_ARRAY_BUFFER);
}

// Positions with their bounds, normals, indices.
tinygltf::Primitive add_surface(tinygltf::Model *gltf, const model *m)
{
    tinygltf::Primitive primitive;
    const int position = add_vertices(gltf, m->positions, m->vertex_count, TINYGLTF_TYPE_VEC3);
    double low[3], high[3];
    model_bounds(m, low, high);
    gltf->accessors[(size_t)position].minValues.assign(low, low + 3);
    gltf->accessors[(size_t)position].maxValues.assign(high, high + 3);
    primitive.attributes["POSITION"] = position;
    primitive.attributes["NORMAL"] = add_vertices(gltf, m->normals, m->vertex_count, TINYGLTF_TYPE_VEC3);
    primitive.indices = add_accessor(gltf, m->triangles, 3 * m->triangle_count, TINYGLTF_TYPE_SCALAR,
                                     TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = 0;
    return primitive;
}

// One node with one mesh of one primitive.
void write_model(const char *path, tinygltf::Model *gltf, const tinygltf::Primitive &primitive)
{
    gltf->meshes.resize(1);
    gltf->meshes[0].primitives.push_back(primitive);
    gltf->nodes.resize(1);
    gltf->nodes[0].mesh = 0;
    gltf->scenes.resize(1);
    gltf->scenes[0].nodes.push_back(0);
    gltf->defaultScene = 0;
    std::ofstream file(path, std::ios::binary);
    if (!file || !tinygltf::TinyGLTF().WriteGltfSceneToStream(gltf, file, false, true) || !file.flush())
    {
        throw failure(std::string("cannot write ") + path + ": " + std::strerror(errno));
    }
}

void save_model(const char *path, const model *m, const float *colors)
{
    tinygltf::Model gltf = new_model();
    tinygltf::Primitive primitive = add_surface(&gltf, m);
    primitive.attributes["COLOR_0"] = add_vertices(&gltf, colors, m->vertex_count, TINYGLTF_TYPE_VEC3);
    gltf.materials.push_back(unlit_material(&gltf));
    write_model(path, &gltf, primitive);
}

// The picture as a buffer view, clamped at its edges, with mipmaps.
int add_texture(tinygltf::Model *gltf, const unsigned char *png, size_t bytes)
{
    std::vector<unsigned char> &data = gltf->buffers[0].data;
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data.size();
    view.byteLength = bytes;
    data.insert(data.end(), png, png + bytes);
    data.resize((data.size() + 3) / 4 * 4); // a binary chunk ends on four bytes
    gltf->bufferViews.push_back(view);
    tinygltf::Image image;
    image.bufferView = (int)gltf->bufferViews.size() - 1;
    image.mimeType = "image/png";
    gltf->images.push_back(image);
    tinygltf::Sampler sampler;
    sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
    sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
    sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    gltf->samplers.push_back(sampler);
    tinygltf::Texture texture;
    texture.source = 0;
    texture.sampler = 0;
    gltf->textures.push_back(texture);
    return 0;
}

void save_textured(const char *path, const model_textured *m)
{
    // A model only reads these arrays, though it could write.
    const model surface = {const_cast<float *>(m->positions), const_cast<float *>(m->normals),
                           const_cast<uint32_t *>(m->triangles), m->vertex_count, m->triangle_count, 0};
    tinygltf::Model gltf = new_model();
    tinygltf::Primitive primitive = add_surface(&gltf, &surface);
    primitive.attributes["TEXCOORD_0"] = add_vertices(&gltf, m->uv, m->vertex_count, TINYGLTF_TYPE_VEC2);
    tinygltf::Material material = unlit_material(&gltf);
    material.pbrMetallicRoughness.baseColorTexture.index = add_texture(&gltf, m->png, m->png_bytes);
    material.pbrMetallicRoughness.metallicFactor = 0.0; // for viewers that light it all the same
    tinygltf::Value::Object extras;
    extras["white"] = tinygltf::Value(m->white);
    material.extras = tinygltf::Value(extras);
    gltf.materials.push_back(material);
    write_model(path, &gltf, primitive);
}

} // namespace

extern "C" int model_load(const char *path, model *out, char *error_text, size_t error_size)
{
    std::memset(out, 0, sizeof *out);
    const int status = guarded(path, error_text, error_size, [&] { load_model(path, out); });
    if (status != 0)
    {
        model_free(out);
    }
    return status;
}

extern "C" void model_free(model *m)
{
    std::free(m->positions);
    std::free(m->normals);
    std::free(m->triangles);
    std::memset(m, 0, sizeof *m);
}

extern "C" int model_save_glb(const char *path, const model *m, const float *colors, char *error_text,
                              size_t error_size)
{
    return guarded(path, error_text, error_size, [&] { save_model(path, m, colors); });
}

extern "C" int model_save_textured_glb(const char *path, const model_textured *m, char *error_text, size_t error_size)
{
    return guarded(path, error_text, error_size, [&] { save_textured(path, m); });
}

extern "C" sss_mesh model_mesh(const model *m, double mm_per_unit)
{
    sss_mesh mesh = {};
    mesh.positions = m->positions;
    mesh.normals = m->normals;
    mesh.triangles = m->triangles;
    mesh.vertex_count = m->vertex_count;
    mesh.triangle_count = m->triangle_count;
    mesh.mm_per_unit = mm_per_unit;
    return mesh;
}

extern "C" double model_bounds(const model *m, double low[3], double high[3])
{
    double extent = 0.0;
    for (size_t k = 0; k < 3; ++k)
    {
        low[k] = high[k] = (double)m->positions[k];
        for (size_t i = 1; i < m->vertex_count; ++i)
        {
            low[k] = std::fmin(low[k], (double)m->positions[3 * i + k]);
            high[k] = std::fmax(high[k], (double)m->positions[3 * i + k]);
        }
        extent = std::fmax(extent, high[k] - low[k]);
    }
    return extent;
}
