#include <cmath>
#include <cstdio>

#include "read.h"

namespace avatar {

static constexpr double most_vertices = 16777216.0;   // of codec incidence
static constexpr double most_decoded = 2147483648.0;  // bytes of all sections and arrays

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
    : reading_(reading), most_(most_of(reading.file_bytes, most_decoded)), left_(most_) {}

void Tensors::read_buffers(Json listed, Program& program) {
    const JsonList said = listed.list();
    program.buffers = reading_.arena.make<Buffer>(said.size);
    if (!program.buffer_names.make(reading_.arena, said.size) || program.buffers.size < said.size) return;
    uint32_t i = 0;
    for (Json one : said) {
        Buffer& buffer = program.buffers[i];
        buffer.name = reading_.arena.copy(one.at("name").text());
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
            buffer.bytes = bytes.number();
            take(buffer.bytes, 8, Place(buffer.name));
        } else {
            buffer.sections = sections(buffer.name, held.list());
            buffer.bytes = bytes_of(buffer.sections);
        }
        if (reading_.failed()) return;
    }
}

/// The count of section vertex_triangle_ptr; -1 where it is not listed.
static double pointers_of(JsonList listed) {
    for (Json one : listed) {
        if (one.at("name").text() == "vertex_triangle_ptr") return one.at("count").number();
    }
    return -1;
}

Span<Section> Tensors::sections(Text buffer, JsonList listed) {
    Span<Section> found = reading_.arena.make<Section>(listed.size);
    if (found.size < listed.size) return {};
    Arena own(reading_.scratch.allocator(), reading_.errors);
    Span<uint32_t> ptr, triangles;  // of codec incidence
    const Section* corners = nullptr;
    size_t count = 0;
    for (Json said : listed) {
        Section& made = found[count];
        made.name = reading_.arena.copy(said.at("name").text());
        const Place where(buffer, made.name);
        for (size_t i = 0; i < count; i++) {
            if (found[i].name == made.name) reading_.errors.set(where, "is named twice");
        }
        const uint32_t bits = static_cast<uint32_t>(said.at("bits").integer());
        const double length = said.at("count").number();
        const Text codec = said.at("codec").text();
        if (reading_.failed()) return {};
        if (codec == "incidence") {
            if (ptr.empty() && 4 * pointers_of(listed) > left_) take(INFINITY, bits, where);
            if (reading_.failed()) return {};
            if (ptr.empty() && !around_vertices(pointers_of(listed) - 1, corners, where, &ptr, &triangles, own)) return {};
            if (!take(length, bits, where)) return {};
            made.elements = narrowed(reading_.arena, made.name == "vertex_triangle_ptr" ? ptr : triangles, bits);
            if (made.elements.length != length) {
                reading_.errors.set(where, "has %u elements, not %.0f", made.elements.length, length);
            }
        } else {
            const Json record = said.at("record");
            const uint32_t size = record.given() ? static_cast<uint32_t>(record.integer()) : 1;
            made.elements = decode(said.at("tensor"), codec, bits, length, size, where, reading_.arena);
        }
        if (reading_.failed()) return {};
        if (made.name == "corners") corners = &made;
        count++;
    }
    return found;
}

bool Tensors::take(double count, uint32_t bits, Text where) {
    left_ -= count * (bits / 8);
    if (left_ >= 0) return true;
    reading_.errors.set(where, "with it the pack takes more than %.0f bytes", most_);
    return false;
}

Elements Tensors::decode(Json tensor, Text codec, uint32_t bits, double count, uint32_t record, Text where, Arena& into) {
    const Text name = tensor.text();
    if (reading_.failed() || !take(count, codec == "pointer" ? 32 : bits, where)) return {};
    const int64_t entry = reading_.header.names.find(name);
    if (entry == Names::none) {
        reading_.errors.set(where, "tensor '%s' is missing", Cut(name, 80).data);
        return {};
    }
    const TensorEntry at = reading_.header.tensors[static_cast<size_t>(entry)];
    return decode_elements(reading_, at, codec, bits, count, record, where, into);
}

HeldArrays Tensors::arrays(Json listed) {
    HeldArrays found;
    const JsonList said = listed.entries();
    found.arrays = reading_.scratch.make<HeldArray>(said.size);
    if (!found.names.make(reading_.scratch, said.size) || found.arrays.size < said.size) return found;
    uint32_t i = 0;
    for (Json one : said) {
        HeldArray& held = found.arrays[i];
        held.name = one.key();
        held.type = one.at("type").text();
        double count = 1;
        for (Json length : one.at("shape").list(0, 4)) {
            held.shape[held.rank] = length.number();
            count *= held.shape[held.rank++];
        }
        const Text codec = one.at("codec").text();
        const uint32_t bits = held.type == "u8" ? 8 : held.type == "u16" ? 16 : 32;
        const Place where(one.key(), 0);
        if (reading_.failed()) return found;
        held.elements = decode(one.at("tensor"), codec, bits, count, 1, where, reading_.scratch);
        found.names.add(held.name, i++);
        if (reading_.failed()) return found;
    }
    return found;
}

/// Triangles around each vertex: those of vertex v, rising, are triangles[ptr[v]] .. triangles[ptr[v + 1] - 1].
bool Tensors::around_vertices(double vertices, const Section* corners, Text where, Span<uint32_t>* ptr, Span<uint32_t>* triangles,
                              Arena& into) const {
    if (corners == nullptr || vertices < 0) {
        reading_.errors.set(where, "codec incidence needs section corners before it");
        return false;
    }
    if (vertices > most_vertices) {
        reading_.errors.set(where, "is for %.0f vertices; %.0f are the most", vertices, most_vertices);
        return false;
    }
    const Elements& of = corners->elements;
    Span<uint32_t> ends = into.make<uint32_t>(static_cast<size_t>(vertices) + 2);  // of the row before
    *triangles = into.make<uint32_t>(of.length);
    if (reading_.failed()) return false;
    for (size_t i = 0; i < of.length; i++) {
        const uint32_t vertex = of[i];
        if (vertex >= vertices || of.length % 3 != 0) {
            reading_.errors.set(where, "has corners that are none of the %.0f vertices", vertices);
            return false;
        }
        ends[vertex + 2]++;
    }
    for (size_t v = 2; v < ends.size; v++) ends[v] += ends[v - 1];
    const uint32_t count = of.length / 3;
    for (uint32_t t = 0; t < count; t++) {
        for (size_t corner = 0; corner < 3; corner++) (*triangles)[ends[of[corner * count + t] + 1]++] = t;
    }
    *ptr = {ends.data, ends.size - 1};
    return true;
}

}  // namespace avatar
