// A whole pack: inflated, read, checked.
#include <cstdio>

#include "../formats/finite.h"
#include "read.h"

namespace avatar {

static constexpr uint64_t header_limit = 16u << 20;  // bytes of JSON
static constexpr uint64_t header_least = 1u << 16, header_ratio = 16;  // and at most the first, and the second times the file
static constexpr double most_ratio = 400;            // inflated bytes a byte of the file; gzip reaches 1032 on zeros alone
static constexpr size_t length_bytes = 8;            // before the header

namespace {

/// The bytes of a body: as gzip inflates them, or all of them at once.
struct Body {
    Gzip* gzip;
    const uint8_t* whole;
    size_t size;

    const uint8_t* bytes() const { return gzip != nullptr ? gzip->bytes() : whole; }
    size_t length() const { return gzip != nullptr ? gzip->length() : size; }
    bool has(size_t length) { return gzip != nullptr ? gzip->inflate(length) : size >= length; }
};

}  // namespace

double most_of(double file_bytes, double limit) { return most_ratio * file_bytes < limit ? most_ratio * file_bytes : limit; }

static bool need(Body& body, size_t length, Errors& errors) {
    if (body.has(length)) return true;
    if (body.gzip != nullptr && body.gzip->wrong != nullptr) {
        errors.set("", "is damaged or cut off (%s); load it again", body.gzip->wrong);
    }
    errors.set("", "ends %zu bytes too early: it was cut off; load it again", length - body.length());
    return false;
}

/// The length of the header; 0 where the error is set.
static size_t header_length(Body& body, size_t file_bytes, Errors& errors) {
    if (!need(body, length_bytes, errors)) return 0;
    uint64_t length = 0;
    for (size_t i = length_bytes; i-- > 0;) length = length << 8 | body.bytes()[i];
    const uint64_t own = header_least + header_ratio * file_bytes, most = own < header_limit ? own : header_limit;
    if (length > most) {
        errors.set("", "claims a header of %llu bytes; up to %llu are read", static_cast<unsigned long long>(length),
                   static_cast<unsigned long long>(most));
    }
    if (errors.any() || !need(body, length_bytes + static_cast<size_t>(length), errors)) return 0;
    return static_cast<size_t>(length);
}

/// Checks that the tensors lie in the body, and that nothing follows.
static bool has_tensors(Body& body, size_t begin, const Header& header, size_t file_bytes, Errors& errors) {
    double total = 0;
    for (const TensorEntry& one : header.tensors) total = one.end > total ? one.end : total;
    if (total > most_of(static_cast<double>(file_bytes))) {
        errors.set("", "claims %.0f bytes in a file of %zu; at most %.0f times its size and %.0f are inflated", total,
                   file_bytes, most_ratio, body_limit);
        return false;
    }
    const size_t end = begin + static_cast<size_t>(total);
    if (!need(body, end, errors)) return false;
    const bool more = body.length() > end || body.has(end + 1);
    if (body.gzip != nullptr && body.gzip->wrong == nullptr && !more) body.gzip->check_end();
    if (more) errors.set("", "goes on after its last tensor");
    else if (body.gzip != nullptr && body.gzip->wrong != nullptr) need(body, SIZE_MAX, errors);
    return !errors.any();
}

/// Every level has its own rows and all groups of the finest, since group transforms are shared.
static void check_levels(const Program& program, Json listed, Avatar& avatar, Arena& arena, Arena& scratch) {
    Errors& errors = arena.errors();
    const JsonList said = listed.list();
    if (!errors.any() && said.size != program.levels.size) {
        errors.set("$.program.levels", "has another number of levels than $.levels");
    }
    size_t index = 0;
    for (Json one : said) {
        if (errors.any()) return;
        double rows = 0;
        for (const Run& run : program.levels[index].chunks) rows += run.count;
        char field[48];
        std::snprintf(field, sizeof(field), "$.levels[%zu].count", index);
        const double count = one.at("count").number();
        if (count != rows) errors.set(field, "is %s; its chunks have %.0f rows", Digits(count).data, rows);
        const Span<Group> groups = read_groups(one, index == 0 ? arena : scratch);
        if (errors.any()) return;
        if (index == 0) avatar.groups = groups;
        bool same = groups.size == avatar.groups.size;
        for (size_t i = 0; same && i < groups.size; i++) same = groups[i].binding == avatar.groups[i].binding;
        std::snprintf(field, sizeof(field), "$.levels[%zu].groups", index);
        if (!same) errors.set(field, "has other groups than the finest level");
        index++;
    }
}

/// Vertices of the mesh; 0 if there is none. Its passes have been checked.
static double vertices_of(const Program& program) {
    for (const Pass& one : program.mesh) {
        const Constant* found = one.constant("vertices");
        if (found != nullptr) return found->number;
    }
    return 0;
}

/// Sections of Pose have the floats that stage joints gives.
static void check_pose_floats(const Avatar& avatar, Errors& errors) {
    const PoseSections& pose = avatar.program.pose;
    const double joints = static_cast<double>(avatar.skeleton.names.size);
    const struct {
        const char* name;
        int32_t floats;
        double needed;
    } sections[] = {
        {"weights", pose.features - pose.weights, static_cast<double>(avatar.expressions.size)},
        {"late", pose.joints - pose.late, static_cast<double>(avatar.late_morphs.size)},
        {"joints", avatar.program.pose_floats - pose.joints, 12 * joints},
        {"features", pose.late - pose.features, 9.0 * static_cast<double>(avatar.skeleton.corrective_joints.size)},
    };
    for (const auto& one : sections) {
        if (one.floats == one.needed || (one.name[0] == 'f' && !avatar.has_skeleton)) continue;
        char field[48];
        std::snprintf(field, sizeof(field), "$.program.pose.%s", one.name);
        errors.set(field, "takes %d floats; the avatar's names need %.0f", one.floats, one.needed);
    }
}

static void check_optional(Text joint, const Avatar& avatar, Text field, Errors& errors) {
    if (joint.size > 0) check_joint(joint, avatar, field, errors);
}

static void check_rotation(const Avatar& avatar, Errors& errors) {
    const char* field = "$.avatar.rules.rotation_joint";
    check_optional(avatar.rules.rotation_joint, avatar, field, errors);
    if (avatar.rules.rotation == "head_bone" && avatar.has_skeleton && avatar.rules.rotation_joint.size == 0) {
        errors.set(field, "rule head_bone needs a rotation_joint");
    }
}

/// Whether an output of the driving matrix is one of the avatar.
static bool is_output(Text output, const Avatar& avatar) {
    const auto rest = [&](uint32_t begin, uint32_t end) { return Text(output.data + begin, output.size - begin - end); };
    if (output.begins("expression/")) {
        const int64_t found = avatar.expression_names.find(rest(11, 0));
        return found >= 0 && avatar.expressions[static_cast<size_t>(found)].name == rest(11, 0);
    }
    if (output.begins("eyelid/")) return avatar.late_names.find(rest(7, 0)) >= 0;
    if (!output.begins("joint/") || output.size < 9 || output.data[output.size - 2] != '/') return false;
    const char axis = output.data[output.size - 1];
    return axis >= 'x' && axis <= 'z' && avatar.joint_names.find(rest(6, 2)) >= 0;
}

static void check_driving(const Avatar& avatar, Errors& errors) {
    for (const Text output : avatar.driving.outputs) {
        if (is_output(output, avatar)) continue;
        errors.set("driving.outputs", "'%s' is no expression/NAME, eyelid/NAME or joint/NAME/x|y|z of this avatar",
                   Cut(output, 80).data);
        return;
    }
    check_optional(avatar.driving.head_joint, avatar, "driving.head_joint", errors);
    check_optional(avatar.driving.left_eye_joint, avatar, "driving.left_eye_joint", errors);
    check_optional(avatar.driving.right_eye_joint, avatar, "driving.right_eye_joint", errors);
}

/// Expressions by name and alias: a name wins over an alias.
static void make_names(Avatar& avatar, Arena& arena) {
    size_t aliases = 0;
    for (const Expression& one : avatar.expressions) aliases += one.aliases.size;
    const size_t joints = avatar.skeleton.names.size;
    if (!avatar.expression_names.make(arena, avatar.expressions.size + aliases)) return;
    if (!avatar.late_names.make(arena, avatar.late_morphs.size) || !avatar.joint_names.make(arena, joints)) return;
    for (uint32_t k = 0; k < avatar.expressions.size; k++) avatar.expression_names.add(avatar.expressions[k].name, k);
    for (uint32_t k = static_cast<uint32_t>(avatar.expressions.size); k-- > 0;) {  // the last of equal aliases wins
        for (const Text alias : avatar.expressions[k].aliases) avatar.expression_names.add(alias, k);
    }
    for (uint32_t k = 0; k < avatar.late_morphs.size; k++) avatar.late_names.add(avatar.late_morphs[k], k);
    for (uint32_t k = 0; k < joints; k++) avatar.joint_names.add(avatar.skeleton.names[k], k);
}

static Text statement(Json avatar, const char* name, Arena& arena) {
    const Json provenance = avatar.at("provenance");
    if (provenance.is_missing()) return {};
    const Json said = provenance.at(name);
    return said.is(JsonKind::text) ? arena.copy(said.text()) : Text();
}

/// The light of the capture goes with passes of stage light.
static Relight read_relight(Json said, const Avatar& avatar) {
    const Program& program = avatar.program;
    Errors& errors = said.errors();
    Relight made = {};
    made.head = Names::none;
    made.given = said.given();
    for (const Level& level : program.levels) {
        if (level.light.empty() == made.given) said.set("goes with passes of stage light, and they with it");
    }
    if (!made.given || errors.any()) return made;
    made.follows = said.at("frame").text() == "head";
    const Json joint = said.at("joint");
    if (joint.given()) check_joint(joint.text(), avatar, "$.avatar.relight.joint", errors);
    if (made.follows && joint.given()) made.head = avatar.joint_names.find(joint.text());
    said.at("centre").vector(made.centre);
    made.radius = said.at("radius").number();
    for (Json row : said.at("ambient").list(9, 9)) {
        double colour[3] = {};
        row.vector(colour);
        if (!all_finite(colour, 3)) row.set("has a number beyond float32");
    }
    return made;
}

static bool read_document(const Reading& reading, Avatar& avatar) {
    Arena &arena = reading.arena, &scratch = reading.scratch;
    Errors& errors = reading.errors;
    const Json document(reading.header.document, errors);
    check_version(document, errors);
    if (!errors.any()) check_form(document, scratch);
    if (!errors.any()) check_shaders(document, errors);
    if (errors.any()) return false;
    Tensors tensors(reading);
    Program& program = avatar.program;
    tensors.read_buffers(document.at("program").at("buffers"), program);
    if (errors.any()) return false;
    read_program(document.at("program"), program, arena);
    if (errors.any()) return false;
    check_levels(program, document.at("levels"), avatar, arena, scratch);
    if (errors.any()) return false;
    check_program(program, static_cast<uint32_t>(avatar.groups.size), scratch, reading.file_bytes);
    if (errors.any()) return false;

    const HeldArrays arrays = tensors.arrays(document.at("arrays"));
    const Json said = document.at("avatar");
    if (errors.any()) return false;
    avatar.expressions = read_expressions(said, arena, scratch);
    avatar.late_morphs = said.at("late_morphs").texts(arena);
    const Json joints = said.at("joints");
    const double vertices = vertices_of(program);
    avatar.has_skeleton = joints.given();
    if (avatar.has_skeleton) {
        const Span<Text> names = joints.texts(arena);
        if (errors.any()) return false;
        const uint32_t expressions = static_cast<uint32_t>(avatar.expressions.size);
        avatar.skeleton = read_skeleton(arrays, names, expressions, vertices, arena);
    }
    if (errors.any()) return false;
    make_names(avatar, arena);
    check_pose_floats(avatar, errors);
    check_groups(avatar.groups, avatar, errors);
    avatar.rules = read_rules(said, arena);
    avatar.relight = read_relight(said.at("relight"), avatar);
    if (errors.any()) return false;
    check_rotation(avatar, errors);
    avatar.has_driving = read_driving(document, arena, avatar.driving);
    if (errors.any()) return false;
    if (avatar.has_driving) check_driving(avatar, errors);
    avatar.name = arena.copy(said.at("name").text());
    avatar.license = statement(said, "licence", arena);
    avatar.consent = statement(said, "consent", arena);
    avatar.left_handed = said.at("frame").at("handedness").text() == "left";
    if (errors.any()) return false;
    avatar.clips = read_clips(said.at("clips"), arrays, avatar, most_of(reading.file_bytes), arena);
    if (errors.any()) return false;
    avatar.levels = read_levels(document, arena);
    avatar.framing = read_framing(document, avatar.left_handed);
    read_bounds(said, avatar.left_handed, avatar.bounds_low, avatar.bounds_high);
    avatar.has_background = read_background(said, avatar.background);
    const HeldArray* preview = arrays.find("preview");
    if (preview != nullptr && preview->type == "u8") avatar.preview = arena.copy(preview->elements.data, preview->elements.length);
    if (avatar.has_skeleton && !program.reads_mesh) avatar.triangles = read_triangles(arrays, vertices, arena);
    return !errors.any();
}

static bool read_from(Body body, size_t file_bytes, Avatar& avatar, Arena& arena) {
    Errors& errors = arena.errors();
    Arena scratch(arena.allocator(), errors);
    Header header(scratch);
    const size_t length = header_length(body, file_bytes, errors);
    if (errors.any()) return false;
    const Text copied = scratch.copy(Text(reinterpret_cast<const char*>(body.bytes()) + length_bytes, length));
    if (errors.any() || !header.read(copied, scratch)) return false;
    const size_t begin = length_bytes + length;
    if (!has_tensors(body, begin, header, file_bytes, errors)) return false;
    avatar.file_bytes = file_bytes;
    return read_document({arena, scratch, errors, header, body.bytes() + begin, static_cast<double>(file_bytes)}, avatar);
}

bool read_pack(const uint8_t* file, size_t bytes, Avatar& avatar, Arena& arena) {
    Errors& errors = arena.errors();
    if (bytes < 2 || file[0] != 0x1f || file[1] != 0x8b) {
        if (bytes > length_bytes && file[length_bytes] == '{' && file[length_bytes - 1] == 0) {
            errors.set("", "was inflated on its way: the server must send packs as they are, without Content-Encoding");
        }
        errors.set("", "is not a pack: it does not begin as a gzip file");
        return false;
    }
    Gzip gzip(file, bytes, arena.allocator(), errors);
    return read_from({&gzip, nullptr, 0}, bytes, avatar, arena);
}

bool read_body(const uint8_t* body, size_t bytes, size_t file_bytes, Avatar& avatar, Arena& arena) {
    return read_from({nullptr, body, bytes}, file_bytes, avatar, arena);
}

}  // namespace avatar
