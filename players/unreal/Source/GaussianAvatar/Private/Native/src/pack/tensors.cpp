// Copy of players/native/src/pack/tensors.cpp by `python -m avatar_shaders`; do not edit.
#include <cstdio>

#include "read.h"

namespace avatar {

static constexpr uint32_t most_buffers = 4096, most_sections = 128, most_record = 1024, most_name = 96;
static constexpr int32_t most_vertices = 65535 * 64;         // of a mesh whose incidence is made; no pass takes more
static constexpr double most_decoded = 2147483648.0;         // bytes of all sections and arrays
static constexpr double most_elements = 2147483647.0 - 63;   // bytes of one: the longest array of some hosts
static const char* const codecs[] = {"raw", "planes", "delta", "pointer", "incidence"};

Place::Place(Text buffer, Text section) {
    const int size = std::snprintf(data, sizeof(data), "buffer %s", Cut(buffer, 80).data);
    if (section.size == 0) return;
    std::snprintf(data + size, sizeof(data) - static_cast<size_t>(size), ", section %s", Cut(section, 80).data);
}

Place::Place(Text array_name, int) { std::snprintf(data, sizeof(data), "array %s", Cut(array_name, 80).data); }

bool HeldArray::is(Text wanted, const double* lengths, uint32_t count) const {
    if (type != wanted || rank != count) return false;
    for (uint32_t i = 0; i < count; i++) {
        if (lengths[i] != -1 && lengths[i] != shape[i]) return false;
    }
    return true;
}

const HeldArray* HeldArrays::find(Text name) const {
    const int64_t found = names.find(name);
    return found == Names::none ? nullptr : &arrays[static_cast<size_t>(found)];
}

Tensors::Tensors(const Reading& reading)
    : reading_(reading), decoded_(reading.scratch.allocator(), reading.errors), left_(most_decoded) {
    known_.make(reading.scratch, reading.header.tensors.size);
}

void Tensors::read_buffers(Json listed, Program& program) {
    const JsonList said = listed.list(0, most_buffers);
    program.buffers = reading_.arena.make<Buffer>(said.size);
    if (!program.buffer_names.make(reading_.arena, said.size) || program.buffers.size < said.size) return;
    uint32_t i = 0;
    for (Json one : said) {
        Buffer& buffer = program.buffers[i];
        buffer.name = reading_.arena.copy(one.at("name").name(most_name));
        if (reading_.failed()) return;
        if (!program.buffer_names.add(buffer.name, i++)) {
            reading_.errors.set(Place(buffer.name), "is named twice");
            return;
        }
        const Json bytes = one.at("bytes"), held = one.at("sections");
        if (bytes.given() != held.is_missing()) {
            reading_.errors.set(Place(buffer.name), "needs either bytes or sections");
            return;
        }
        if (bytes.given()) {
            buffer.bytes = bytes.whole(0, 2147483647.0);
        } else {
            buffer.sections = sections(buffer.name, held.list(1, most_sections));
            buffer.bytes = bytes_of(buffer.sections);
        }
        if (reading_.failed()) return;
    }
}

static uint32_t bits_of(Json said) {
    const double bits = said.is(JsonKind::number) ? said.number() : 0;
    if (bits == 8 || bits == 16 || bits == 32) return static_cast<uint32_t>(bits);
    said.fail("8, 16 or 32 is needed");
    return 8;
}

Span<Section> Tensors::sections(Text buffer, JsonList listed) {
    Span<Section> found = reading_.arena.make<Section>(listed.size);
    if (found.size < listed.size) return {};
    Elements ptr, triangles;
    bool has_around = false;
    size_t count = 0;
    for (Json said : listed) {
        const Text name = reading_.arena.copy(said.at("name").name(most_name));
        const Place where(buffer, name);
        for (size_t i = 0; i < count; i++) {
            if (found[i].name == name) reading_.errors.set(where, "is named twice");
        }
        const uint32_t bits = bits_of(said.at("bits"));
        const double length = said.at("count").whole();
        const Text codec = said.at("codec").one(codecs);
        if (reading_.failed()) return {};
        Elements elements;
        if (codec == "incidence") {
            if (!has_around && !around_vertices(listed, {found.data, count}, where, &ptr, &triangles)) return {};
            has_around = true;
            const Elements& wide = name == "vertex_triangle_ptr" ? ptr : triangles;
            Span<uint32_t> words = reading_.scratch.make<uint32_t>(wide.length);
            for (size_t i = 0; i < words.size; i++) words[i] = wide[i];
            elements = narrowed(reading_.arena, bits == 32 ? reading_.arena.copy(words.data, words.size) : words, bits);
            if (elements.length != length) {
                reading_.errors.set(where, "has %u elements, not %.0f", elements.length, length);
            }
        } else {
            const Json record = said.at("record");
            const uint32_t size = record.given() ? static_cast<uint32_t>(record.integer(1, most_record)) : 1;
            elements = decode(said.at("tensor"), codec, bits, length, size, where, reading_.arena);
        }
        if (reading_.failed()) return {};
        found[count].name = name;
        found[count++].elements = elements;
    }
    return found;
}

Elements Tensors::decode(Json tensor, Text codec, uint32_t bits, double count, uint32_t record, Text where, Arena& into) {
    const Text name = tensor.text();
    if (reading_.failed()) return {};
    const int64_t entry = reading_.header.names.find(name);
    uint32_t* newest = known_.place(name);
    for (uint32_t at = newest == nullptr ? UINT32_MAX : *newest; at != UINT32_MAX; at = decoded_[at].next) {
        const Decoded& one = decoded_[at];
        if (one.codec == codec && one.bits == bits && one.count == count && one.record == record) return one.elements;
    }
    if (entry == Names::none) {
        reading_.errors.set(where, "tensor '%s' is missing", Cut(name, most_name).data);
        return {};
    }
    const double bytes = count * (codec == "pointer" ? 4 : bits / 8);
    left_ -= bytes;
    if (left_ < 0 || bytes > most_elements) {
        reading_.errors.set(where, "with it the pack takes more than %.0f bytes", most_decoded);
        return {};
    }
    const TensorEntry at = reading_.header.tensors[static_cast<size_t>(entry)];
    Decoded made = {codec, name, count, bits, record, newest == nullptr ? UINT32_MAX : *newest, {}};
    made.elements = decode_elements(reading_, at, codec, bits, count, record, where, into);
    if (!reading_.failed() && made.elements.length != count) {
        reading_.errors.set(where, "has %u elements, not %.0f", made.elements.length, count);
    }
    if (reading_.failed()) return {};
    const uint32_t place = static_cast<uint32_t>(decoded_.size());
    if (!decoded_.add(made)) return {};
    if (newest != nullptr) *newest = place;
    else known_.add(name, place);
    return made.elements;
}

HeldArrays Tensors::arrays(Json listed) {
    static const char* const types[] = {"f32", "u8", "u16", "u32", "i32"};
    static const char* const array_codecs[] = {"raw", "planes"};
    HeldArrays found;
    const JsonList said = listed.entries();
    found.arrays = reading_.scratch.make<HeldArray>(said.size);
    if (!found.names.make(reading_.scratch, said.size) || found.arrays.size < said.size) return found;
    uint32_t i = 0;
    for (Json one : said) {
        HeldArray& held = found.arrays[i];
        held.name = one.key();
        held.type = one.at("type").one(types);
        double count = 1;
        for (Json length : one.at("shape").list(0, 4)) {
            held.shape[held.rank] = length.whole();
            count *= held.shape[held.rank++];
        }
        const Text codec = one.at("codec").one(array_codecs);
        const uint32_t bits = held.type == "u8" ? 8 : held.type == "u16" ? 16 : 32;
        const Place where(one.key(), 0);
        if (count > 4294967295.0) {
            reading_.errors.set(where, "has %s numbers; 4294967295 are the most", Digits(count).data);
        }
        if (reading_.failed()) return found;
        held.elements = decode(one.at("tensor"), codec, bits, count, 1, where, reading_.scratch);
        found.names.add(held.name, i++);
        if (reading_.failed()) return found;
    }
    return found;
}

/// Triangles around each vertex: those of vertex v, rising, are triangles[ptr[v]] .. triangles[ptr[v + 1] - 1].
bool Tensors::around_vertices(JsonList listed, Span<Section> found, Text where, Elements* ptr, Elements* triangles) {
    const Section* corners = nullptr;
    for (const Section& one : found) {
        if (one.name == "corners") corners = &one;
    }
    double vertices = -1;
    for (Json one : listed) {
        const Json name = one.at("name");
        if (vertices == -1 && name.is(JsonKind::text) && name.text() == "vertex_triangle_ptr") {
            vertices = one.at("count").integer(0, most_vertices + 1) - 1;
            if (vertices < 0) vertices = 0;
        }
        if (reading_.failed()) return false;
    }
    if (corners == nullptr || vertices < 0) {
        reading_.errors.set(where, "codec incidence needs section corners before it");
        return false;
    }
    const Elements& of = corners->elements;
    Span<uint32_t> ends = reading_.scratch.make<uint32_t>(static_cast<size_t>(vertices) + 1);
    Span<uint32_t> next = reading_.scratch.make<uint32_t>(static_cast<size_t>(vertices) + 1);
    Span<uint32_t> around = reading_.scratch.make<uint32_t>(of.length);
    if (reading_.failed()) return false;
    for (size_t i = 0; i < of.length; i++) {
        const uint32_t vertex = of[i];
        if (vertex >= vertices || of.length % 3 != 0) {
            reading_.errors.set(where, "has corners that are none of the %.0f vertices", vertices);
            return false;
        }
        ends[vertex + 1]++;
    }
    for (size_t v = 0; v + 1 < ends.size; v++) ends[v + 1] += ends[v];
    std::memcpy(next.data, ends.data, ends.size * sizeof(uint32_t));
    const uint32_t count = of.length / 3;
    for (uint32_t t = 0; t < count; t++) {
        for (size_t corner = 0; corner < 3; corner++) around[next[of[corner * count + t]]++] = t;
    }
    *ptr = narrowed(reading_.scratch, ends, 32);
    *triangles = narrowed(reading_.scratch, around, 32);
    return true;
}

}  // namespace avatar
