// Copy of players/native/src/pose/anchors.cpp by `python -m avatar_shaders`; do not edit.
#include "anchors.h"

#include <cmath>
#include <cstdio>

namespace avatar {

namespace {

/// One vertex in the packed buffers of stage morph or skin: the pass that reads it, and its row there.
struct MeshRow {
    const Pass* pass = nullptr;
    const Buffer* held = nullptr;
    uint32_t row = 0;

    double constant(const char* name) const { return pass->constant(name)->number; }
    const Elements& section(const char* name) const { return held->find(name)->elements; }
    /// Bits of a section's elements.
    uint32_t width(const char* name) const {
        char constant_name[64];
        std::snprintf(constant_name, sizeof(constant_name), "%s_width", name);
        return static_cast<uint32_t>(constant(constant_name));
    }
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

}  // namespace

/// The row of a vertex; without a pass where no pass of the entry poses it.
static MeshRow row_of(const Program& program, const char* entry, const char* buffer, uint32_t vertex) {
    MeshRow found;
    for (const Pass& one : program.mesh) {
        if (one.entry != entry) continue;
        const double row = vertex - one.constant("first")->number;
        if (row < 0 || row >= one.constant("count")->number) continue;
        found.pass = &one;
        found.held = &program.buffers[one.buffer(buffer)->index];
        found.row = static_cast<uint32_t>(row);
        break;
    }
    return found;
}

/// Writes the neutral position [3].
static void set_template(const MeshRow& row, double* into) {
    const uint32_t count = static_cast<uint32_t>(row.constant("count")), width = row.width("template_position");
    const Elements& section = row.section("template_position");
    for (uint32_t c = 0; c < 3; c++) {
        const size_t element = static_cast<size_t>(c) * count + row.row;
        if (width == 32) {
            into[c] = static_cast<double>(section.float_at(element));
            continue;
        }
        const Elements& scale = row.section("template_position_scale");
        const double code = width == 0 ? 0 : section[element];
        const float step = static_cast<float>(static_cast<double>(scale.float_at(2 * c + 1)) * code);  // as the kernel rounds
        into[c] = static_cast<double>(
            static_cast<float>(static_cast<double>(scale.float_at(2 * c)) + static_cast<double>(step)));
    }
}

/// Writes the values of an entry: three channels, or one of skin weights.
static void decode_entry(const MeshRow& row, const Part& part, size_t entry, uint32_t column, double* into) {
    const uint32_t width = row.width(part.value);
    const Elements& section = row.section(part.value);
    for (uint32_t c = 0; c < part.channels; c++) {
        const size_t element = part.channels * entry + c;
        if (width == 0) {
            into[c] = 0;  // of signed codes the middle, of weights the code 0
        } else if (width == 32) {
            into[c] = static_cast<double>(section.float_at(element));
        } else {
            const bool weights = part.channels == 1;
            const double step = static_cast<double>(row.section(part.step).float_at(weights ? 0 : 3 * column + c));
            const double middle = weights ? 0 : static_cast<double>(1u << (width - 1));
            into[c] = static_cast<double>(static_cast<float>(step * (section[element] - middle)));
        }
    }
}

static MeshEntries entries_of(Span<MeshRow> rows, const Part& part, Arena& arena) {
    size_t count = 0;
    for (const MeshRow& one : rows) {
        const Elements& pointer = one.section(part.ptr);
        count += pointer[one.row + 1] - pointer[one.row];
    }
    MeshEntries made;
    made.row = arena.make<uint32_t>(count);
    made.column = arena.make<uint32_t>(count);
    made.value = arena.make<double>(count * part.channels);
    if (arena.errors().any()) return {};
    size_t at = 0;
    for (uint32_t a = 0; a < rows.size; a++) {
        const Elements &pointer = rows[a].section(part.ptr), &columns = rows[a].section(part.column);
        const size_t end = pointer[rows[a].row + 1];
        for (size_t e = pointer[rows[a].row]; e < end; e++) {
            made.row[at] = a;
            made.column[at] = columns[e];
            decode_entry(rows[a], part, e, columns[e], &made.value[at * part.channels]);
            at++;
        }
    }
    return made;
}

void MeshEntries::add_to(Span<double> vertices, const float* weights) const {
    for (size_t e = 0; e < row.size; e++) {
        const double weight = static_cast<double>(weights[column[e]]);
        if (weight == 0) continue;
        double* to = &vertices[3 * static_cast<size_t>(row[e])];
        for (size_t c = 0; c < 3; c++) to[c] += weight * value[3 * e + c];
    }
}

void Anchors::make(const Program& program, Span<uint32_t> vertices, Arena& arena) {
    Span<MeshRow> morph_rows = arena.make<MeshRow>(vertices.size), skin_rows = arena.make<MeshRow>(vertices.size);
    rest = arena.make<double>(3 * vertices.size);
    posed = arena.make<double>(3 * vertices.size);
    morphed_ = arena.make<double>(3 * vertices.size);
    if (arena.errors().any()) return;
    for (size_t a = 0; a < vertices.size; a++) {
        morph_rows[a] = row_of(program, "morph", "MorphStatic", vertices[a]);
        skin_rows[a] = row_of(program, "skin", "SkinStatic", vertices[a]);
        if (morph_rows[a].pass == nullptr || skin_rows[a].pass == nullptr) {
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
    for (size_t e = 0; e < skin_.row.size; e++) {
        const double* from = &morphed_[3 * static_cast<size_t>(skin_.row[e])];
        double* to = &posed[3 * static_cast<size_t>(skin_.row[e])];
        const double* m = matrices + 12 * static_cast<size_t>(skin_.column[e]);
        for (size_t c = 0; c < 3; c++, m += 4) {
            to[c] += skin_.value[e] * (m[0] * from[0] + m[1] * from[1] + m[2] * from[2] + m[3]);
        }
    }
    late_.add_to(posed, pose + at.late);
}

}  // namespace avatar
