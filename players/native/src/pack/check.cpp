// Checks a whole program. Every pass is held to the access contract of its entry. What concerns several passes is here:
// buffers, the layout of Pose, the order of passes, chunks, and the work of a frame.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "access.h"

namespace avatar {

static constexpr double most_bytes_in_all = 4294967296.0;
static constexpr double most_buffer = 2147483647.0;  // bytes: sizes in OpenGL's interface are signed
static constexpr size_t most_passes = 1 << 14;     // of one list
static constexpr double most_work = 1 << 28;       // rows and entries of one frame of a level
static constexpr double work_ratio = 16;           // and at most so many a byte of the file
static constexpr double most_columns = 1 << 16;    // of a section of Pose
static constexpr double joint_floats = 12;
static constexpr size_t most_agreed = 8;           // constants of one buffer, or of one entry
static const char* const group_table = "group_";   // names of the frame that begin so have a row a group

namespace {

/// A list of passes: the stages that it may have in their order, and what of the frame it may ask for.
struct PassKind {
    const char* list;
    const char* stages[3];
    int stage_count;
    const char* sources[5];  // beginnings of names of the frame
    int source_count;
};

const PassKind mesh_kind = {"mesh", {"morph", "skin"}, 2, {}, 0};
const PassKind deform_kind = {"deform", {"blend", "bind", "activate"}, 3, {"world_", "group_"}, 2};
const PassKind view_kind = {"view", {"project"}, 1, {"camera_", "clip_", "eye", "tan_half_fov", "image_size"}, 5};
const PassKind shadow_kind = {"shadow", {"shadow"}, 1, {"shadow_row", "world_row"}, 2};
const PassKind light_kind = {"light", {"light"}, 1, {"light_", "shadow_", "world_quat"}, 3};

/// A constant on which passes agree.
struct Agreed {
    const char* constant;
    double value;
};

/// What passes say of a buffer.
struct Use {
    Text role;       // of a buffer without sections: the one name that shaders give it
    double touched;  // bytes
    Agreed agreed[most_agreed];
};

class Checker {
public:
    Checker(Program& program, uint32_t groups, double file_bytes, Arena& scratch)
        : program_(program), groups_(groups), most_work_(std::fmin(most_work, work_ratio * file_bytes)), scratch_(scratch), errors_(scratch.errors()) {
        held_.program = &program;
    }

    void check();

private:
    bool failed() const { return errors_.any(); }
    void check_buffers();
    void check_packed(const Buffer& buffer);
    void check_pose();
    void check_pose_section(int which, const char* name, int32_t first, int32_t end, double floats);
    void check_level(const char* place, Level& level, double work_before);
    double check_list(const char* place, const PassKind& kind, Span<Pass> passes, Span<uint8_t> written, const Level* level);
    bool check_stage(const Access& access, const PassKind& kind, size_t index, int* reached);
    bool check_source(const Access& access, const PassKind& kind, const Constant& constant);
    bool check_bound(const Access& access, Span<uint8_t> written);
    bool check_role(const Access& access, const Bound& one, Span<uint8_t> written);
    bool check_chunk(const Access& access, const Level& level);
    bool agree(const Access& access, Agreed* known, const char* what, const Table<const char*>& constants);
    void check_sizes();

    Program& program_;
    uint32_t groups_;
    double most_work_;
    Arena& scratch_;
    Errors& errors_;
    Held held_ = {};
    Span<Use> uses_;               // by buffer
    Span<uint8_t> written_, level_written_;  // by buffer: an earlier pass writes it
    Span<Agreed> level_agreed_;    // of each entry, in the level in hand
    char level_place_[32] = "";
};

void Checker::check() {
    uses_ = scratch_.make<Use>(program_.buffers.size);
    written_ = scratch_.make<uint8_t>(program_.buffers.size);
    level_written_ = scratch_.make<uint8_t>(program_.buffers.size);
    level_agreed_ = scratch_.make<Agreed>(interface_count * most_agreed);
    if (failed()) return;
    check_buffers();
    if (!failed()) check_pose();
    if (failed()) return;
    const double work = check_list("mesh", mesh_kind, program_.mesh, written_, nullptr);
    if (!failed()) check_mesh(program_, held_.pose[3].items > 0, errors_);
    if (!failed() && program_.levels.empty()) errors_.set("levels", "there is none");
    for (size_t index = 0; index < program_.levels.size && !failed(); index++) {
        std::snprintf(level_place_, sizeof(level_place_), "level %zu", index);
        check_level(level_place_, program_.levels[index], work);
    }
    for (size_t a = 0; a < program_.levels.size && !failed(); a++) {
        for (size_t b = 0; b < a; b++) {
            if (program_.levels[a].prefix == program_.levels[b].prefix) {
                errors_.set("levels", "two levels have the same prefix");
            }
        }
    }
    if (!failed()) check_sizes();
}

void Checker::check_buffers() {
    double total = 0;
    held_.packed = scratch_.make<Packed>(program_.buffers.size);
    for (size_t i = 0; i < program_.buffers.size && !failed(); i++) {
        const Buffer& buffer = program_.buffers[i];
        total += buffer.bytes;
        if (!(buffer.bytes >= 0 && buffer.bytes <= most_buffer)) {
            errors_.set(Place(buffer.name), "has %s bytes; %.0f are the most", Digits(buffer.bytes).data, most_buffer);
        }
        if (buffer.sections.empty()) continue;
        check_packed(buffer);
        if (!failed()) held_.packed[i].make(buffer, scratch_);
    }
    if (total > most_bytes_in_all) {
        errors_.set("buffers", "have %.0f bytes; %.0f are the most", total, most_bytes_in_all);
    }
}

void Checker::check_packed(const Buffer& buffer) {
    for (size_t i = 0; i < buffer.sections.size; i++) {
        for (size_t before = 0; before < i; before++) {
            if (buffer.sections[i].name != buffer.sections[before].name) continue;
            char where[300];
            std::snprintf(where, sizeof(where), "buffer %s, %s", Cut(buffer.name, 80).data,
                          Cut(buffer.sections[i].name, 80).data);
            errors_.set(where, "is a duplicate");
            return;
        }
    }
    const double needed = bytes_of(buffer.sections);
    if (buffer.bytes != needed) {
        errors_.set(Place(buffer.name), "has %.0f bytes; its sections take %.0f", buffer.bytes, needed);
    }
}

/// Sections of Pose follow each other without a gap.
void Checker::check_pose() {
    const PoseSections& pose = program_.pose;
    if (pose.weights != 0) errors_.set("pose", "weights begins at %d, not at 0", pose.weights);
    check_pose_section(0, "weights", pose.weights, pose.features, 1);
    check_pose_section(1, "features", pose.features, pose.late, 1);
    check_pose_section(2, "late", pose.late, pose.joints, 1);
    check_pose_section(3, "joints", pose.joints, program_.pose_floats, joint_floats);
}

void Checker::check_pose_section(int which, const char* name, int32_t first, int32_t end, double floats) {
    const double length = static_cast<double>(end) - first;
    if (length < 0 || length > floats * most_columns || std::fmod(length, floats) != 0) {
        errors_.set("pose", "%s takes %.0f floats", name, length);
    }
    held_.pose[which] = {name, static_cast<double>(first), length / floats};
}

void Checker::check_level(const char* place, Level& level, double work_before) {
    check_chunks(place, level, errors_);
    if (failed()) return;
    if (!written_.empty()) std::memcpy(level_written_.data, written_.data, written_.size);
    std::memset(static_cast<void*>(level_agreed_.data), 0, level_agreed_.size * sizeof(Agreed));
    const PassKind* const kinds[] = {&deform_kind, &view_kind, &shadow_kind, &light_kind};
    const Span<Pass> lists[] = {level.deform, level.view, level.shadow, level.light};
    const bool lit = !level.light.empty();
    double work = work_before;
    for (int i = 0; i < (lit ? 4 : 2); i++) {
        work += check_list(ListName(place, kinds[i]->list).data, *kinds[i], lists[i], level_written_, &level);
        if (failed()) return;
    }
    if (!lit && !level.shadow.empty()) errors_.set(ListName(place, "shadow").data, "casts shadows that no pass reads");
    if (work > most_work_) {
        errors_.set(place, "has %.0f rows and entries a frame; %.0f are the most", work, most_work_);
        return;
    }
    check_projected(place, level, scratch_);
    bool reads = false;
    for (const Pass& one : level.deform) reads |= one.buffer("Mesh") != nullptr;
    if (program_.reads_mesh != reads) {
        const char* said = program_.reads_mesh ? "true" : "false";
        errors_.set("reads_mesh", "is %s; the passes of %s differ", said, place);
    }
    if (!failed()) check_placed(place, level, program_.reads_mesh, scratch_);
}

/// The rows and entries of all passes; buffers that they write join `written`.
double Checker::check_list(const char* place, const PassKind& kind, Span<Pass> passes, Span<uint8_t> written,
                           const Level* level) {
    if (passes.size > most_passes) {
        errors_.set(place, "has %zu passes; %zu are the most", passes.size, most_passes);
        return 0;
    }
    if (level != nullptr && passes.empty()) errors_.set(place, "has no passes");
    double work = 0;
    int reached = 0;
    for (size_t index = 0; index < passes.size; index++) {
        char where[80];
        std::snprintf(where, sizeof(where), "%s pass %zu", place, index);
        Access access(where, passes[index], held_, errors_);
        bool sound = access.check_names() && check_stage(access, kind, index, &reached) && access.check_constants();
        for (size_t i = 0; sound && i < access.pass.constants.size; i++) {
            const Constant& one = access.pass.constants[i];
            sound = one.kind != Constant::Kind::source || check_source(access, kind, one);
        }
        sound = sound && check_bound(access, written) && (level == nullptr || check_chunk(access, *level));
        if (!sound) return 0;
        work += access.pass.rows + access.check_sections();
        if (failed()) return 0;
    }
    return work;
}

bool Checker::check_stage(const Access& access, const PassKind& kind, size_t index, int* reached) {
    int stage = -1;
    for (int i = 0; i < kind.stage_count; i++) {
        if (Text(access.declared->stage) == kind.stages[i]) stage = i;
    }
    if (stage < *reached || (index == 0 && stage != 0)) {
        char order[48];
        size_t size = 0;
        for (int i = 0; i < kind.stage_count; i++) {
            const char* gap = i > 0 ? ", " : "";
            size += static_cast<size_t>(std::snprintf(order + size, sizeof(order) - size, "%s%s", gap, kind.stages[i]));
        }
        return access.fail("entry", "stage %s is out of place; the order is %s", access.declared->stage, order);
    }
    *reached = stage;
    return true;
}

bool Checker::check_source(const Access& access, const PassKind& kind, const Constant& constant) {
    Text name;
    int64_t row = -1;
    const FrameSource* source = nullptr;
    bool is_known = false;
    if (split_source(constant.source, &name, &row)) {
        for (uint32_t i = 0; i < frame_source_count; i++) {
            if (name == frame_sources[i].name) source = &frame_sources[i];
        }
        for (int i = 0; i < kind.source_count; i++) is_known |= name.begins(kind.sources[i]);
    }
    if (source == nullptr || !is_known) {
        return access.fail(constant.name, "'%s' is no value of the frame for these passes", Cut(constant.source, 80).data);
    }
    const ConstantType type = access.type_of(constant.name);
    if (static_cast<uint32_t>(type) != source->floats) {
        char needed[16];
        std::snprintf(needed, sizeof(needed), "float%u", static_cast<uint32_t>(type));
        return access.fail(constant.name, "'%s' has %u floats; a %s is needed", Cut(constant.source, 80).data, source->floats, needed);
    }
    if ((row >= 0) != name.begins(group_table)) {
        return access.fail(constant.name, "'%s' needs %s", Cut(constant.source, 80).data, row >= 0 ? "no row" : "a row, NAME[i]");
    }
    if (row >= groups_) {
        return access.fail(constant.name, "'%s' is beyond the %u groups", Cut(constant.source, 80).data, groups_);
    }
    return true;
}

/// Buffers without sections: one name each, written before they are read, large enough, agreed upon.
bool Checker::check_bound(const Access& access, Span<uint8_t> written) {
    for (const Bound& one : access.pass.buffers) {
        if (access.is_packed(one.name)) continue;
        if (!check_role(access, one, written)) return false;
        const double bytes = access.storage(one.name)->stride * access.touched_elements(one.name);
        if (failed()) return false;
        Use& use = uses_[one.index];
        use.touched = bytes > use.touched ? bytes : use.touched;
        const double has = program_.buffers[one.index].bytes;
        if (bytes > has) {
            const Cut shown(one.buffer, 80);
            return access.fail(one.name, "takes %s bytes; '%s' has %.0f", Digits(bytes).data, shown.data, has);
        }
    }
    for (const Same& one : access.contract().same) {
        const Bound* bound = access.pass.buffer(one.buffer);
        if (!agree(access, uses_[bound->index].agreed, Cut(bound->buffer, 80).data, one.constants)) return false;
    }
    for (const Bound& one : access.pass.buffers) {
        if (!access.storage(one.name)->is_read_only) written[one.index] = 1;
    }
    return true;
}

bool Checker::check_role(const Access& access, const Bound& one, Span<uint8_t> written) {
    const Cut shown(one.buffer, 80);
    Text& role = uses_[one.index].role;
    if (role.size == 0) role = one.name;
    if (role != one.name) {
        return access.fail(one.name, "'%s' is bound as %s elsewhere", shown.data, Cut(role, 80).data);
    }
    if ((one.name == "Pose" || one.name == "Mesh") && one.buffer != one.name) {  // players write them, by these names
        const Cut name(one.name, 80);
        return access.fail(one.name, "is bound to '%s'; players write buffer '%s'", shown.data, name.data);
    }
    if (access.storage(one.name)->is_read_only && written[one.index] == 0 && one.name != "Pose") {
        return access.fail(one.name, "no earlier pass writes '%s'", shown.data);
    }
    return true;
}

bool Checker::agree(const Access& access, Agreed* known, const char* what, const Table<const char*>& constants) {
    for (const char* constant : constants) {
        const double value = access.count(constant);
        size_t at = 0;
        while (at < most_agreed - 1 && known[at].constant != nullptr && Text(known[at].constant) != constant) at++;
        if (known[at].constant == nullptr) known[at] = {constant, value};
        if (known[at].value != value) {
            const Digits said(value), first(known[at].value);
            return access.fail(constant, "is %s; an earlier pass over %s has %s", said.data, what, first.data);
        }
    }
    return true;
}

bool Checker::check_chunk(const Access& access, const Level& level) {
    char what[96];
    std::snprintf(what, sizeof(what), "%s (%s)", level_place_, access.declared->entry);
    Agreed* known = &level_agreed_[static_cast<size_t>(access.declared - interfaces) * most_agreed];
    if (!agree(access, known, what, access.contract().level)) return false;
    const char* constant = access.contract().chunk;
    if (constant == nullptr) return true;
    int64_t chunk = -1;
    for (const char* kind : {"Splats", "Sh", "Projected"}) {
        const Bound* bound = access.pass.buffer(kind);
        if (bound == nullptr) continue;
        const int64_t index = chunk_index(level, kind, bound->buffer);
        if (index < 0 || (chunk >= 0 && chunk != index)) {
            return access.fail(kind, "'%s' is no buffer of this chunk", Cut(bound->buffer, 80).data);
        }
        chunk = index;
    }
    if (chunk < 0) return true;
    const int32_t rows = level.chunks[static_cast<size_t>(chunk)].count;
    if (access.count(constant) == rows) return true;
    const Digits said(access.count(constant));
    return access.fail(constant, "is %s; chunk %lld has %d rows", said.data, static_cast<long long>(chunk), rows);
}

/// Buffers without sections are as large as what is touched, so that a small file takes little memory.
void Checker::check_sizes() {
    for (size_t i = 0; i < program_.buffers.size; i++) {
        const Buffer& buffer = program_.buffers[i];
        if (!buffer.sections.empty()) continue;
        const double needed = buffer.name == "Pose" ? 4.0 * program_.pose_floats : uses_[i].touched;
        if (buffer.bytes == needed) continue;
        errors_.set(Place(buffer.name), "has %.0f bytes; passes touch %s", buffer.bytes, Digits(needed).data);
        return;
    }
}

}  // namespace

void check_program(Program& program, uint32_t groups, Arena& scratch, double file_bytes) {
    Checker(program, groups, file_bytes, scratch).check();
}

}  // namespace avatar
