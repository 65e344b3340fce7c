#include "reference.h"

#include <cstdio>

namespace avatar {

static constexpr size_t length_size = 8;  // bytes before the header of a .safetensors file
static const char* const vectors_owner = "the vectors of the reference";
static const char* const cases_owner = "the cases of the reference";

namespace {

/// The tensors of a .safetensors file as float64, which holds all numbers of a reference exactly.
struct Vectors {
    Names names;
    Span<Span<double>> tensors;

    bool read(const uint8_t* file, size_t bytes, Arena& arena);
};

/// Reads the cases of a document.
class Reader {
public:
    Reader(const Vectors& vectors, Arena& arena) : vectors_(vectors), arena_(arena) {}

    Case read_case(Json said);

private:
    Step read_step(Json said);
    Expected read_expected(Json said);
    Span<double> tensor(Json said);

    const Vectors& vectors_;
    Arena& arena_;
};

}  // namespace

template <class T>
static Span<double> converted(const uint8_t* from, size_t bytes, Arena& arena) {
    Span<double> made = arena.make<double>(bytes / sizeof(T));
    for (size_t i = 0; i < made.size; i++) {
        T value;
        std::memcpy(&value, from + i * sizeof(T), sizeof(T));
        made[i] = static_cast<double>(value);
    }
    return made;
}

static Span<double> tensor_values(const uint8_t* from, size_t bytes, Json dtype, Arena& arena) {
    const Text type = dtype.text();
    if (type == "F64") return converted<double>(from, bytes, arena);
    if (type == "F32") return converted<float>(from, bytes, arena);
    if (type == "I64") return converted<int64_t>(from, bytes, arena);
    if (type == "I32") return converted<int32_t>(from, bytes, arena);
    if (type == "U32") return converted<uint32_t>(from, bytes, arena);
    if (type == "U16") return converted<uint16_t>(from, bytes, arena);
    if (type != "U8") dtype.fail("a type of numbers is needed");
    return converted<uint8_t>(from, bytes, arena);
}

bool Vectors::read(const uint8_t* file, size_t bytes, Arena& arena) {
    Errors& errors = arena.errors();
    uint64_t length = 0;
    for (size_t i = length_size; i-- > 0 && bytes >= length_size;) length = length << 8 | file[i];
    if (bytes < length_size || length > bytes - length_size) {
        errors.set("", "ends before its header does");
        return false;
    }
    JsonTree tree(arena, "header");
    if (!tree.parse(Text(reinterpret_cast<const char*>(file) + length_size, static_cast<size_t>(length)))) {
        errors.set("", "the header is not JSON: %s", tree.why);
        return false;
    }
    const size_t begin = length_size + static_cast<size_t>(length);
    const double most = static_cast<double>(bytes - begin);
    const JsonList said = Json(tree, errors).entries();
    tensors = arena.make<Span<double>>(said.size);
    if (!names.make(arena, said.size) || tensors.size < said.size) return false;
    uint32_t count = 0;
    for (Json one : said) {
        if (one.key() == "__metadata__") continue;
        const JsonList offsets = one.at("data_offsets").list(2, 2);
        if (errors.any()) return false;
        const double first = offsets[0].whole(0, most), end = offsets[1].whole(first, most);
        if (errors.any()) return false;
        const uint8_t* from = file + begin + static_cast<size_t>(first);
        tensors[count] = tensor_values(from, static_cast<size_t>(end - first), one.at("dtype"), arena);
        names.add(arena.copy(one.key()), count++);
        if (errors.any()) return false;
    }
    return true;
}

/// The values of a tensor, which has the shape that the entry says.
Span<double> Reader::tensor(Json said) {
    const Text name = said.at("tensor").text();
    double elements = 1;
    for (Json size : said.at("shape").list()) elements *= size.integer();
    if (arena_.errors().any()) return {};
    const int64_t at = vectors_.names.find(name);
    char line[200];
    if (at == Names::none) {
        std::snprintf(line, sizeof(line), "the vectors have no tensor '%s'", Cut(name, 40).data);
        said.set(line);
        return {};
    }
    const Span<double> values = vectors_.tensors[static_cast<size_t>(at)];
    if (elements == static_cast<double>(values.size)) return values;
    std::snprintf(line, sizeof(line), "tensor '%s' has %zu elements, not %.0f", Cut(name, 40).data, values.size, elements);
    said.set(line);
    return {};
}

Expected Reader::read_expected(Json said) {
    Expected made = {};
    made.name = arena_.copy(said.key());
    made.values = tensor(said);
    const JsonList shape = said.at("shape").list();
    made.rows = shape.size == 0 ? 1 : static_cast<size_t>(shape[0].integer());
    made.atol = said.at("atol").number();
    made.rtol = said.at("rtol").number();
    const Json weight = said.at("weight"), flips = said.at("flips"), most = said.at("most_flips");
    made.has_weight = weight.given();
    if (made.has_weight) made.weight = tensor(weight);
    if (made.has_weight && made.weight.size < made.rows) weight.set("has fewer elements than the output has rows");
    if (flips.given()) made.flips = arena_.copy(flips.text());
    if (most.given()) made.most_flips = static_cast<uint32_t>(most.integer());
    return made;
}

Step Reader::read_step(Json said) {
    Step made = {};
    made.stage = arena_.copy(said.at("stage").text());
    const Json profile = said.at("profile"), pixels = said.at("pixels");
    if (profile.given()) made.profile = arena_.copy(profile.text());
    made.has_pixels = pixels.given();
    if (made.has_pixels) made.pixels = tensor(pixels);
    const JsonList outputs = said.at("outputs").entries();
    for (Json one : said.at("inputs").entries()) {
        if (arena_.errors().any()) return made;
        made.inputs.add(arena_.copy(one.key()), tensor(one));
    }
    made.outputs = arena_.make<Expected>(outputs.size);
    size_t at = 0;
    for (Json one : outputs) {
        if (arena_.errors().any()) return made;
        made.outputs[at++] = read_expected(one);
    }
    return made;
}

static void read_floats(JsonList listed, float* into) {
    for (Json one : listed) *into++ = static_cast<float>(one.number());
}

static AvatarCamera read_camera(Json said) {
    AvatarCamera made = {};
    read_floats(said.at("camera_from_world").list(16, 16), made.camera_from_world);
    read_floats(said.at("clip_from_world").list(16, 16), made.clip_from_world);
    read_floats(said.at("centre").list(3, 3), made.centre);
    made.tan_half_fov[0] = static_cast<float>(said.at("tan_half_fov_x").number());
    made.tan_half_fov[1] = static_cast<float>(said.at("tan_half_fov_y").number());
    made.width = said.at("width").integer(1, 1 << 15);
    made.height = said.at("height").integer(1, 1 << 15);
    return made;
}

Case Reader::read_case(Json said) {
    Case made = {};
    made.name = arena_.copy(said.at("name").text());
    const Json camera = said.at("camera"), within = said.at("within_range");
    made.has_camera = camera.given();
    if (made.has_camera) made.camera = read_camera(camera);
    made.within_range = within.given() && within.flag();
    const JsonList stages = said.at("stages").list();
    made.steps = arena_.make<Step>(stages.size);
    size_t at = 0;
    for (Json one : stages) {
        if (arena_.errors().any()) return made;
        made.steps[at++] = read_step(one);
    }
    return made;
}

Span<Case> read_reference(Text cases, const uint8_t* vectors, size_t bytes, Arena& arena) {
    Errors& errors = arena.errors();
    Vectors held;
    errors.set_owner(vectors_owner);
    if (!held.read(vectors, vectors == nullptr ? 0 : bytes, arena)) return {};
    errors.set_owner(cases_owner);
    JsonTree tree(arena, "$");
    if (!tree.parse(cases)) {
        errors.set("", "is not JSON: %s", tree.why);
        return {};
    }
    Reader reader(held, arena);
    const JsonList said = Json(tree, errors).at("cases").list();
    Span<Case> made = arena.make<Case>(said.size);
    size_t at = 0;
    for (Json one : said) {
        if (errors.any()) return {};
        made[at++] = reader.read_case(one);
    }
    return errors.any() ? Span<Case>{} : made;
}

}  // namespace avatar
