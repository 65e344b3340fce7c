#include "anchors.h"

#include <cmath>
#include <cstdio>

namespace avatar {

namespace {

/// Vertices of the mesh, and the pass of stage morph or skin that poses them.
struct MeshRows {
    double first, count;
    const Pass* pass;
    const Buffer* held;

    const Elements& section(const char* name) const { return held->find(name)->elements; }
    /// Bits of a section's elements.
    uint32_t width(const char* name) const {
        char constant_name[64];
        std::snprintf(constant_name, sizeof(constant_name), "%s_width", name);
        return static_cast<uint32_t>(pass->constant(constant_name)->number);
    }
};

/// The row of a vertex.
struct MeshRow {
    const MeshRows* in;
    uint32_t row;
};

/// How a part of the rows is called, and its values.
struct Part {
    const char* ptr;
    const char* column;
    const char* value;
    const char* step;
    uint32_t channels;
};

const Part morph_part = {"morph_ptr", "morph_column", "morph_position", "morph_position_step", 3};
const Part corrective_part = {"corrective_ptr", "corrective_column", "corrective_position", "corrective_position_step", 3};
const Part late_part = {"late_ptr", "late_column", "late_position", "late_position_step", 3};
const Part skin_part = {"skin_ptr", "skin_column", "skin_weight", "skin_weight_step", 1};

/// The sections of a part in the buffer of a pass.
struct HeldPart {
    const MeshRows* in = nullptr;
    const Elements *ptr, *column, *value;
    const Section* step;  // null where no value needs it
    uint32_t width;

    HeldPart(const MeshRows& rows, const Part& part)
        : in(&rows), ptr(&rows.section(part.ptr)), column(&rows.section(part.column)), value(&rows.section(part.value)),
          step(rows.held->find(part.step)), width(rows.width(part.value)) {}
    size_t begin(const MeshRow& of) const { return (*ptr)[of.row]; }
    /// Behind the last entry. Values without bits are 0: of signed codes the middle, of weights the code 0.
    size_t end(const MeshRow& of) const { return width == 0 ? begin(of) : (*ptr)[of.row + 1]; }
};

}  // namespace

/// The passes of an entry, in their order.
static Span<MeshRows> rows_of(const Program& program, const char* entry, const char* buffer, Arena& arena) {
    Span<MeshRows> found = arena.make<MeshRows>(program.mesh.size);
    size_t count = 0;
    for (const Pass& one : program.mesh) {
        if (found.empty() || one.entry != entry) continue;
        const Buffer& held = program.buffers[one.buffer(buffer)->index];
        found[count++] = {one.constant("first")->number, one.constant("count")->number, &one, &held};
    }
    found.size = count;
    return found;
}

/// The row of a vertex in the first pass that poses it; null: none does.
static MeshRow row_of(Span<MeshRows> passes, uint32_t vertex) {
    for (const MeshRows& one : passes) {
        const double row = vertex - one.first;
        if (row >= 0 && row < one.count) return {&one, static_cast<uint32_t>(row)};
    }
    return {nullptr, 0};
}

/// Writes the neutral position [3].
static void set_template(const MeshRow& of, double* into) {
    const uint32_t count = static_cast<uint32_t>(of.in->count), width = of.in->width("template_position");
    const Elements& section = of.in->section("template_position");
    for (uint32_t c = 0; c < 3; c++) {
        const size_t element = static_cast<size_t>(c) * count + of.row;
        if (width == 32) {
            into[c] = static_cast<double>(section.float_at(element));
            continue;
        }
        const Elements& scale = of.in->section("template_position_scale");
        const double code = width == 0 ? 0 : section[element];
        const float step = static_cast<float>(static_cast<double>(scale.float_at(2 * c + 1)) * code);  // as the kernel rounds
        into[c] = static_cast<double>(
            static_cast<float>(static_cast<double>(scale.float_at(2 * c)) + static_cast<double>(step)));
    }
}

/// Writes the values of an entry: three channels, or one of skin weights.
static void decode_entry(const HeldPart& held, uint32_t channels, size_t entry, uint32_t column, float* into) {
    for (uint32_t c = 0; c < channels; c++) {
        const size_t element = channels * entry + c;
        if (held.width == 32) {
            into[c] = held.value->float_at(element);
        } else {
            const bool weights = channels == 1;
            const double step = static_cast<double>(held.step->elements.float_at(weights ? 0 : 3 * column + c));
            const double middle = weights ? 0 : static_cast<double>(1u << (held.width - 1));
            into[c] = static_cast<float>(step * ((*held.value)[element] - middle));
        }
    }
}

static MeshEntries entries_of(Span<MeshRow> rows, const Part& part, Arena& arena) {
    MeshEntries made;
    made.ends = arena.make<uint32_t>(rows.size);
    if (made.ends.empty()) return {};
    HeldPart held(*rows[0].in, part);
    size_t count = 0;
    for (size_t a = 0; a < rows.size; a++) {
        if (rows[a].in != held.in) held = HeldPart(*rows[a].in, part);
        count += held.end(rows[a]) - held.begin(rows[a]);
        made.ends[a] = static_cast<uint32_t>(count);
    }
    made.column = arena.make<uint32_t>(count);
    made.value = arena.make<float>(count * part.channels);
    if (arena.errors().any()) return {};
    size_t at = 0;
    for (const MeshRow& one : rows) {
        if (one.in != held.in) held = HeldPart(*one.in, part);
        for (size_t e = held.begin(one), end = held.end(one); e < end; e++, at++) {
            made.column[at] = (*held.column)[e];
            decode_entry(held, part.channels, e, made.column[at], &made.value[at * part.channels]);
        }
    }
    return made;
}

void MeshEntries::add_to(Span<double> vertices, const float* weights) const {
    size_t e = 0;
    for (size_t a = 0; a < ends.size; a++) {
        double* to = &vertices[3 * a];
        for (; e < ends[a]; e++) {
            const double weight = static_cast<double>(weights[column[e]]);
            if (weight == 0) continue;
            for (size_t c = 0; c < 3; c++) to[c] += weight * static_cast<double>(value[3 * e + c]);
        }
    }
}

void Anchors::make(const Program& program, Span<uint32_t> vertices, Arena& arena) {
    Arena scratch(arena.allocator(), arena.errors());
    const Span<MeshRows> morph = rows_of(program, "morph", "MorphStatic", scratch), skin = rows_of(program, "skin", "SkinStatic", scratch);
    Span<MeshRow> morph_rows = scratch.make<MeshRow>(vertices.size), skin_rows = scratch.make<MeshRow>(vertices.size);
    rest = arena.make<double>(3 * vertices.size);
    posed = arena.make<double>(3 * vertices.size);
    morphed_ = arena.make<double>(3 * vertices.size);
    if (arena.errors().any()) return;
    for (size_t a = 0; a < vertices.size; a++) {
        morph_rows[a] = row_of(morph, vertices[a]);
        skin_rows[a] = row_of(skin, vertices[a]);
        if (morph_rows[a].in == nullptr || skin_rows[a].in == nullptr) {
            arena.errors().set("array rig.anchor_vertices", "no pass poses vertex %u, which an anchor group follows",
                               vertices[a]);
            return;
        }
        set_template(morph_rows[a], &rest[3 * a]);
    }
    morphs_ = entries_of(morph_rows, morph_part, arena);
    correctives_ = entries_of(morph_rows, corrective_part, arena);
    late_ = entries_of(skin_rows, late_part, arena);
    skin_ = entries_of(skin_rows, skin_part, arena);
    std::memcpy(posed.data, rest.data, rest.size * sizeof(double));
}

void Anchors::update(const float* pose, const PoseSections& at, const double* matrices) {
    std::memcpy(morphed_.data, rest.data, rest.size * sizeof(double));
    morphs_.add_to(morphed_, pose + at.weights);
    correctives_.add_to(morphed_, pose + at.features);
    std::memset(posed.data, 0, posed.size * sizeof(double));
    size_t e = 0;
    for (size_t a = 0; a < skin_.ends.size; a++) {
        const double* from = &morphed_[3 * a];
        double* to = &posed[3 * a];
        for (; e < skin_.ends[a]; e++) {
            const double* m = matrices + 12 * static_cast<size_t>(skin_.column[e]);
            const double weight = static_cast<double>(skin_.value[e]);
            for (size_t c = 0; c < 3; c++, m += 4) to[c] += weight * (m[0] * from[0] + m[1] * from[1] + m[2] * from[2] + m[3]);
        }
    }
    late_.add_to(posed, pose + at.late);
}

}  // namespace avatar
