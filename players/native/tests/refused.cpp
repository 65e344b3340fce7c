// What the functions of avatar_player.h make of NULL, of numbers that are not finite, of what is not there, and of calls in
// the wrong order: each refuses it, with a line where its handle can hold one, and changes nothing.
#include <cstring>
#include <initializer_list>
#include <limits>
#include <type_traits>

#include "checks.h"

namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
constexpr double bad_numbers[] = {nan_value, infinity, -infinity, 1e300};
constexpr uint32_t beyond = 4000000000u;

struct Table {
    Records& out;
    size_t rows = 0;

    /// A row: `good` is whether it was refused; `line` must hold `words`, in one line. `words` NULL: there is no line.
    void row(const char* what, bool good, const char* line = nullptr, const char* words = nullptr) {
        const bool told = words == nullptr || (line != nullptr && std::strstr(line, words) != nullptr && std::strchr(line, '\n') == nullptr);
        const std::string said = std::string(good ? "" : "was not refused; ") + (told ? "" : line != nullptr ? line : "no line");
        out.text(std::to_string(rows++) + " " + what, good && told ? "" : said.c_str());
    }
};

void packs(Table& t, const AvatarPack* pack, const AvatarPack* broken) {
    t.row("avatar_open NULL", avatar_error(broken) != nullptr, avatar_error(broken), "nothing.avatar: is not a pack");
    const AvatarAllocator empty = {nullptr, nullptr, nullptr};
    t.row("avatar_open allocator", avatar_open("", 0, nullptr, &empty) == nullptr);
    avatar_close(nullptr);
    t.row("avatar_error NULL", avatar_error(nullptr) != nullptr, avatar_error(nullptr), "NULL");
    avatar_facts(pack, nullptr);
    for (const AvatarPack* one : {static_cast<const AvatarPack*>(nullptr), broken}) {
        AvatarFacts facts;
        std::memset(&facts, 1, sizeof(facts));
        avatar_facts(one, &facts);
        t.row("avatar_facts", facts.name == nullptr && facts.expressions == 0 && facts.bounds_low == nullptr);
    }
    AvatarGroup group;
    AvatarClip clip;
    AvatarLevel level;
    AvatarChunk chunk;
    AvatarBuffer buffer;
    uint32_t count = 7;
    double low = 1, high = 1;
    for (const AvatarPack* one : {static_cast<const AvatarPack*>(nullptr), broken, pack}) {
        t.row("avatar_expression_name", avatar_expression_name(one, beyond) == nullptr);
        t.row("avatar_expression_alias", avatar_expression_alias(one, beyond, 0) == nullptr && avatar_expression_alias(one, 0, beyond) == nullptr);
        t.row("avatar_eyelid_name", avatar_eyelid_name(one, beyond) == nullptr);
        t.row("avatar_joint_name", avatar_joint_name(one, beyond) == nullptr);
        t.row("avatar_group_name", avatar_group_name(one, beyond) == nullptr);
        for (const char* name : {static_cast<const char*>(nullptr), "", "no such name", "\xff\xfe"}) {
            t.row("avatar_expression_index", avatar_expression_index(one, name) == -1);
            t.row("avatar_eyelid_index", avatar_eyelid_index(one, name) == -1);
            t.row("avatar_joint_index", avatar_joint_index(one, name) == -1);
            t.row("avatar_buffer_index", avatar_buffer_index(one, name) == -1);
        }
        avatar_expression_range(one, beyond, &low, &high);
        avatar_expression_range(one, 0, nullptr, nullptr);
        t.row("avatar_expression_range", low == 0 && high == 0);
        t.row("avatar_group", avatar_group(one, beyond, &group) == 0 && avatar_group(one, 0, nullptr) == 0);
        t.row("avatar_clip", avatar_clip(one, beyond, &clip) == 0 && avatar_clip(one, 0, nullptr) == 0);
        t.row("avatar_level", avatar_level(one, beyond, &level) == 0 && avatar_level(one, 0, nullptr) == 0);
        t.row("avatar_level_for", avatar_level_for(one, nan_value) == 0);
        t.row("avatar_next_level", avatar_next_level(one, nan_value, beyond) == 0 && avatar_next_level(one, infinity, beyond) == 0);
        t.row("avatar_chunk", avatar_chunk(one, beyond, 0, &chunk) == 0 && avatar_chunk(one, 0, beyond, &chunk) == 0 && avatar_chunk(one, 0, 0, nullptr) == 0);
        t.row("avatar_buffer", avatar_buffer(one, beyond, &buffer) == 0 && avatar_buffer(one, 0, nullptr) == 0);
        t.row("avatar_buffer_content", avatar_buffer_content(one, beyond, &buffer) == 0 && avatar_buffer_content(one, 0, nullptr) == 0);
        avatar_triangles(one, nullptr);
        if (one == pack) continue;
        t.row("avatar_joint_parents", avatar_joint_parents(one) == nullptr);
        t.row("avatar_rest_local", avatar_rest_local(one) == nullptr);
        t.row("avatar_inverse_bind", avatar_inverse_bind(one) == nullptr);
        t.row("avatar_triangles", avatar_triangles(one, &count) == nullptr && count == 0);
    }
}

void cameras(Table& t, AvatarInstance* instance) {
    const double target[3] = {0, 0, 0}, identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, k[9] = {50, 0, 32, 0, 50, 24, 0, 0, 1};
    const double view[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -2, 0, 0, 0, 1};
    const double projection[16] = {1.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1, -0.2, 0, 0, -1, 0};
    AvatarCamera camera, before;
    t.row("sound", avatar_camera_orbit(&camera, target, 1, 0, 0, 0.8, 64, 48) == nullptr);
    before = camera;
    const auto orbit = [&](const char* words, const double* at, double distance, double yaw, double pitch, double fov, int32_t width, int32_t height) {
        const char* line = avatar_camera_orbit(&camera, at, distance, yaw, pitch, fov, width, height);
        t.row("avatar_camera_orbit", line != nullptr && std::memcmp(&camera, &before, sizeof(camera)) == 0, line, words);
    };
    orbit("NULL", nullptr, 1, 0, 0, 0.8, 64, 48);
    for (const double bad : bad_numbers) {
        const double away[3] = {0, bad, 0};
        orbit("not finite", away, 1, 0, 0, 0.8, 64, 48);
        orbit("not finite", target, bad, 0, 0, 0.8, 64, 48);
        orbit("not finite", target, 1, bad, 0, 0.8, 64, 48);
        orbit("not finite", target, 1, 0, bad, 0.8, 64, 48);
        orbit("fov_y", target, 1, 0, 0, bad, 64, 48);
    }
    for (const double bad : {0.0, -0.5, 3.15, 6.0}) orbit("fov_y", target, 1, 0, 0, bad, 64, 48);
    orbit("", target, 1, 0, 0, 1e-320, 64, 48);
    for (const int32_t bad : {0, -1, INT32_MIN, 32769, INT32_MAX}) {
        orbit("1 to 32768", target, 1, 0, 0, 0.8, bad, 48);
        orbit("1 to 32768", target, 1, 0, 0, 0.8, 64, bad);
    }
    t.row("avatar_camera_orbit NULL", avatar_camera_orbit(nullptr, target, 1, 0, 0, 0.8, 64, 48) != nullptr);

    const auto opencv = [&](const char* words, const double* rotation, const double* translation, const double* intrinsics, int32_t width) {
        const char* line = avatar_camera_opencv(&camera, rotation, translation, intrinsics, width, 48);
        t.row("avatar_camera_opencv", line != nullptr && std::memcmp(&camera, &before, sizeof(camera)) == 0, line, words);
    };
    opencv("NULL", nullptr, target, k, 64);
    opencv("NULL", identity, nullptr, k, 64);
    opencv("NULL", identity, target, nullptr, 64);
    opencv("1 to 32768", identity, target, k, 0);
    t.row("avatar_camera_opencv NULL", avatar_camera_opencv(nullptr, identity, target, k, 64, 48) != nullptr);
    double changed[16];
    const auto with = [&](const double* from, size_t count, size_t at, double value) {
        std::memcpy(changed, from, count * sizeof(double));
        changed[at] = value;
        return changed;
    };
    for (const double bad : bad_numbers) {
        opencv("not finite", with(identity, 9, 4, bad), target, k, 64);
        opencv("not finite", identity, with(target, 3, 2, bad), k, 64);
        opencv("not finite", identity, target, with(k, 9, 2, bad), 64);
    }
    opencv("rotation", with(identity, 9, 0, -1), target, k, 64);
    opencv("rotation", with(identity, 9, 0, 2), target, k, 64);
    opencv("rotation", with(identity, 9, 1, 0.5), target, k, 64);
    for (const size_t at : {0u, 4u, 8u}) opencv("intrinsics", identity, target, with(k, 9, at, 0), 64);
    for (const size_t at : {3u, 6u, 7u}) opencv("intrinsics", identity, target, with(k, 9, at, 1), 64);
    opencv("intrinsics", identity, target, with(k, 9, 4, -50), 64);

    const auto opengl = [&](const char* words, const double* v, const double* p, int32_t width) {
        const char* line = avatar_camera_opengl(&camera, v, p, width, 48);
        t.row("avatar_camera_opengl", line != nullptr && std::memcmp(&camera, &before, sizeof(camera)) == 0, line, words);
    };
    opengl("NULL", nullptr, projection, 64);
    opengl("NULL", view, nullptr, 64);
    opengl("1 to 32768", view, projection, -3);
    t.row("avatar_camera_opengl NULL", avatar_camera_opengl(nullptr, view, projection, 64, 48) != nullptr);
    for (const double bad : bad_numbers) {
        opengl("not finite", with(view, 16, 3, bad), projection, 64);
        opengl("not finite", view, with(projection, 16, 0, bad), 64);
    }
    opengl("perspective", view, with(projection, 16, 14, 0), 64);
    opengl("perspective", view, with(projection, 16, 15, 1), 64);
    opengl("turns it over", view, with(projection, 16, 5, -2), 64);
    opengl("mirrors", view, with(projection, 16, 0, 0), 64);
    opengl("not finite", with(view, 16, 0, 0), projection, 64);

    // One that was filled in by hand, and a place.
    t.row("avatar_update_camera NULL", avatar_update_camera(instance, nullptr) == 0, avatar_instance_error(instance), "NULL");
    AvatarCamera own = before;
    own.clip_from_world[5] = std::numeric_limits<float>::quiet_NaN();
    t.row("avatar_update_camera NaN", avatar_update_camera(instance, &own) == 0, avatar_instance_error(instance), "not finite");
    own = before;
    own.tan_half_fov[1] = 0;
    t.row("avatar_update_camera", avatar_update_camera(instance, &own) == 0, avatar_instance_error(instance), "tan_half_fov");
    t.row("avatar_height_px", avatar_height_px(instance, &own) == infinity && avatar_height_px(instance, nullptr) == infinity);
    own = before;
    own.width = 0;
    t.row("avatar_update_camera", avatar_update_camera(instance, &own) == 0, avatar_instance_error(instance), "1 to 32768");
    t.row("sound", avatar_update_camera(instance, &before) == 1 && avatar_instance_error(instance) == nullptr);
    for (const double bad : bad_numbers) {
        avatar_place(instance)[7] = bad;
        t.row("avatar_place", avatar_update_camera(instance, &before) == 0, avatar_instance_error(instance), "place");
        t.row("avatar_height_px", avatar_height_px(instance, &before) == infinity);
    }
    avatar_place(instance)[7] = 0;
    t.row("sound", avatar_update_camera(instance, &before) == 1);
}

void no_instance(Table& t, const AvatarPack* pack, AvatarInstance* bad) {
    const double target[3] = {0, 0, 0};
    AvatarCamera camera;
    AvatarFrame frame = {};
    uint32_t count = 7;
    avatar_camera_orbit(&camera, target, 1, 0, 0, 0.8, 64, 48);
    for (AvatarInstance* one : {static_cast<AvatarInstance*>(nullptr), bad}) {
        const char* line = avatar_instance_error(one);
        t.row("avatar_instance_error", line != nullptr, line, one == nullptr ? "NULL" : "there is no level");
        avatar_reset_pose(one);
        t.row("avatar_set_expression", avatar_set_expression(one, "jawOpen", 1) == 0);
        t.row("avatar_set_eyelid", avatar_set_eyelid(one, "left", 1) == 0);
        t.row("avatar_set_joint", avatar_set_joint(one, "neck", 0, 0, 0) == 0);
        t.row("avatar_expression_weights", avatar_expression_weights(one) == nullptr);
        t.row("avatar_eyelid_weights", avatar_eyelid_weights(one) == nullptr);
        t.row("avatar_joint_delta", avatar_joint_delta(one) == nullptr);
        t.row("avatar_world_from_avatar", avatar_world_from_avatar(one) == nullptr);
        t.row("avatar_place", avatar_place(one) == nullptr);
        t.row("avatar_set_level", avatar_set_level(one, 0) == 0);
        t.row("avatar_instance_level", avatar_instance_level(one) == 0);
        t.row("avatar_set_clip", avatar_set_clip(one, 0, 0) == 0);
        t.row("avatar_enable_driving", avatar_enable_driving(one, 1) == 0);
        t.row("avatar_drive", avatar_drive(one, &frame) == 0);
        t.row("avatar_update_pose", avatar_update_pose(one) == 0);
        t.row("avatar_update_camera", avatar_update_camera(one, &camera) == 0);
        t.row("avatar_height_px", avatar_height_px(one, &camera) == infinity);
        t.row("avatar_pose_floats", avatar_pose_floats(one, &count) == nullptr && count == 0);
        t.row("avatar_group_matrix", avatar_group_matrix(one) == nullptr);
        t.row("avatar_group_rotation", avatar_group_rotation(one) == nullptr);
    }
    t.row("avatar_instance_open NULL", avatar_instance_open(nullptr, 0, nullptr) == nullptr);
    avatar_instance_close(nullptr);
    AvatarPack* broken = avatar_open("xxxx", 4, nullptr, nullptr);
    AvatarInstance* of = avatar_instance_open(broken, 0, nullptr);
    t.row("avatar_instance_open broken", avatar_update_pose(of) == 0, avatar_instance_error(of), "could not be loaded");
    avatar_instance_close(of);
    avatar_close(broken);
    avatar_pose_floats(bad, nullptr);
    (void)pack;
}

void poses(Table& t, const AvatarPack* pack, AvatarInstance* instance) {
    const auto line = [&] { return avatar_instance_error(instance); };
    t.row("avatar_drive too early", avatar_drive(instance, nullptr) == 0, line(), "avatar_enable_driving");
    for (const char* name : {static_cast<const char*>(nullptr), "", "no such name", "\xff\xfe\n"}) {
        t.row("avatar_set_expression name", avatar_set_expression(instance, name, 1) == 0, line(), "expression");
        t.row("avatar_set_eyelid name", avatar_set_eyelid(instance, name, 1) == 0, line(), "eyelid");
        t.row("avatar_set_joint name", avatar_set_joint(instance, name, 0, 0, 0) == 0, line(), "joint");
    }
    const char *expression = avatar_expression_name(pack, 0), *eyelid = avatar_eyelid_name(pack, 0), *joint = avatar_joint_name(pack, 0);
    AvatarFacts facts;
    avatar_facts(pack, &facts);
    for (const double bad : bad_numbers) {
        t.row("avatar_set_expression", avatar_set_expression(instance, expression, bad) == 0, line(), "finite");
        t.row("avatar_set_eyelid", eyelid == nullptr || avatar_set_eyelid(instance, eyelid, bad) == 0);
        t.row("avatar_set_joint", avatar_set_joint(instance, joint, bad, 0, -bad) == 0, line(), "finite");
    }
    t.row("avatar_set_level", avatar_set_level(instance, beyond) == 0, line(), "there is no level");
    t.row("avatar_set_clip", avatar_set_clip(instance, beyond, 0) == 0, line(), "there is no clip");
    for (const double seconds : bad_numbers) t.row("sound time", avatar_set_clip(instance, 0, seconds) == 1 && avatar_update_pose(instance) == 1);

    // What was written into the arrays; the floats of the newest sound pose stay.
    avatar_reset_pose(instance);
    avatar_update_pose(instance);
    uint32_t count = 0;
    const float* floats = avatar_pose_floats(instance, &count);
    const std::vector<float> before(floats, floats + count);
    const auto refuses = [&](const char* array, auto* numbers, size_t at, double value, const char* words) {
        using Number = std::remove_reference_t<decltype(*numbers)>;
        const Number kept = numbers[at];
        numbers[at] = static_cast<Number>(value);
        const bool good = avatar_update_pose(instance) == 0;
        t.row(array, good && std::memcmp(before.data(), floats, 4 * before.size()) == 0, line(), words);
        numbers[at] = kept;
    };
    for (const double bad : {nan_value, infinity, -infinity}) {
        refuses("expression_weights", avatar_expression_weights(instance), facts.expressions - 1, bad, "expression_weights");
        refuses("joint_delta", avatar_joint_delta(instance), 16 * facts.joints - 5, bad, "joint_delta");
        refuses("world_from_avatar", avatar_world_from_avatar(instance), 3, bad, "world_from_avatar");
        if (facts.eyelids > 0) refuses("eyelid_weights", avatar_eyelid_weights(instance), 0, bad, "eyelid_weights");
    }
    refuses("joint_delta", avatar_joint_delta(instance), 0, 1e300, "joint_delta");
    avatar_joint_delta(instance)[0] = 3e38;
    avatar_joint_delta(instance)[5] = 3e38;
    avatar_expression_weights(instance)[0] = 3e38f;
    t.row("beyond float32", avatar_update_pose(instance) == 0, line(), "beyond");
    avatar_reset_pose(instance);
    t.row("sound", avatar_update_pose(instance) == 1 && std::memcmp(before.data(), floats, 4 * before.size()) == 0);

    AvatarFrame frame = {};
    t.row("sound", avatar_enable_driving(instance, 1) == 1 && avatar_drive(instance, &frame) == 1);
    t.row("avatar_drive NULL", avatar_drive(instance, nullptr) == 0, line(), "frame");
    for (const double bad : bad_numbers) {
        frame = {};
        frame.weights[51] = static_cast<float>(bad < 1e40 ? bad : infinity);
        t.row("avatar_drive weight", avatar_drive(instance, &frame) == 0, line(), "tongueOut");
        frame = {};
        frame.right_eye[2] = bad;
        t.row("avatar_drive angle", avatar_drive(instance, &frame) == 0, line(), "rightEyeRoll");
    }
}

void captures(Table& t) {
    t.row("avatar_arkit_name", avatar_arkit_name(61) == nullptr && avatar_arkit_name(beyond) == nullptr);
    t.row("avatar_arkit_channel", avatar_arkit_channel(nullptr) == -1 && avatar_arkit_channel("") == -1);
    AvatarFrame frame = {};
    t.row("avatar_read_packet", avatar_read_packet(nullptr, 9, &frame) == 0 && avatar_read_packet("\6", 1, nullptr) == 0 && avatar_read_packet("\6", 0, &frame) == 0);
    AvatarRecording* none = avatar_recording_open(nullptr, 12, nullptr, nullptr);
    t.row("avatar_recording_open NULL", avatar_recording_error(none) != nullptr, avatar_recording_error(none), "no text");
    AvatarRecordingFacts facts;
    for (AvatarRecording* one : {static_cast<AvatarRecording*>(nullptr), none}) {
        t.row("avatar_recording_facts", avatar_recording_facts(one, &facts) == 0 && avatar_recording_facts(one, nullptr) == 0);
        t.row("avatar_recording_sample", avatar_recording_sample(one, 0, &frame) == 0 && avatar_recording_sample(one, 0, nullptr) == 0);
    }
    t.row("avatar_recording_error NULL", avatar_recording_error(nullptr) != nullptr);
    avatar_recording_close(none);
    avatar_recording_close(nullptr);
}

void passes(Table& t, const AvatarPack* pack, const AvatarPack* other, AvatarInstance* instance) {
    AvatarPasses* const wrong[] = {nullptr, avatar_passes_open(nullptr, 0, 0, nullptr), avatar_passes_open(pack, beyond, 0, nullptr),
                                   avatar_passes_open(pack, 0, 3, nullptr)};
    for (AvatarPasses* one : wrong) {
        size_t bytes = 7;
        t.row("avatar_passes_open", avatar_passes_error(one) != nullptr);
        t.row("avatar_passes_count", avatar_passes_count(one) == 0);
        t.row("avatar_dispatch", avatar_dispatch(one, 0) == nullptr);
        t.row("avatar_passes_blocks", avatar_passes_blocks(one, &bytes) == nullptr && bytes == 0);
        t.row("avatar_passes_set", avatar_passes_set(one, instance) == 0);
        t.row("avatar_passes_keep_lasting", avatar_passes_keep_lasting(one) == 0);
        avatar_passes_close(one);
    }
    AvatarPasses* view = avatar_passes_open(pack, 0, AVATAR_VIEW, nullptr);
    AvatarInstance* of_other = avatar_instance_open(other, 0, nullptr);
    t.row("avatar_dispatch", avatar_dispatch(view, beyond) == nullptr);
    t.row("avatar_passes_blocks", avatar_passes_blocks(view, nullptr) != nullptr);
    t.row("avatar_passes_set NULL", avatar_passes_set(view, nullptr) == 0, avatar_passes_error(view), "no sound instance");
    t.row("avatar_passes_set other", avatar_passes_set(view, of_other) == 0, avatar_passes_error(view), "of another pack");
    avatar_passes_set(view, instance);
    t.row("sound", avatar_passes_error(view) == nullptr);
    avatar_instance_close(of_other);
    avatar_passes_close(view);

    const AvatarSceneChunk nameless = {nullptr, 3}, many[] = {{"a", 4000000}, {"b", 4000000}}, few = {"a", 3};
    AvatarSort* const sorts[] = {nullptr, avatar_sort_open(nullptr, 2, nullptr), avatar_sort_open(&nameless, 1, nullptr), avatar_sort_open(many, 2, nullptr)};
    AvatarSceneBuffer buffer;
    for (AvatarSort* one : sorts) {
        t.row("avatar_sort_open", avatar_sort_error(one) != nullptr);
        t.row("avatar_sort_count", avatar_sort_count(one) == 0);
        t.row("avatar_sort_buffer", avatar_sort_buffer(one, 0, &buffer) == 0);
        t.row("avatar_sort_passes", avatar_passes_count(avatar_sort_passes(one)) == 0);
        t.row("avatar_sort_dispatches", avatar_sort_dispatches(one) == 0);
        avatar_sort_close(one);
    }
    AvatarSort* sound = avatar_sort_open(&few, 1, nullptr);
    t.row("avatar_sort_buffer", avatar_sort_buffer(sound, 4, &buffer) == 0 && avatar_sort_buffer(sound, 0, nullptr) == 0);
    avatar_sort_close(sound);
    const char* entry = nullptr;
    t.row("avatar_shader", avatar_shader(0, nullptr) == nullptr && avatar_shader(9, "blend") == nullptr && avatar_shader(0, "no") == nullptr);
    t.row("avatar_shader_at", avatar_shader_at(beyond, 0, &entry) == nullptr && avatar_shader_at(0, beyond, nullptr) == nullptr);
}

void reports(Table& t, const AvatarPack* pack) {
    const AvatarStageRunner holes = {};
    AvatarReport* const wrong[] = {nullptr, avatar_conform(nullptr, "{}", 2, "", 0, nullptr, nullptr), avatar_conform(pack, nullptr, 9, "", 0, nullptr, nullptr),
                                   avatar_conform(pack, "{}", 2, nullptr, 9, nullptr, nullptr), avatar_conform(pack, "{}", 2, "", 0, &holes, nullptr),
                                   avatar_conform(pack, "{}", size_t{1} << 40, "", 0, nullptr, nullptr)};
    const char* const words[] = {"NULL", "could not be loaded", "cases", "vectors", "runner", "cases"};
    AvatarReportRow row;
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        t.row("avatar_conform", avatar_report_error(wrong[i]) != nullptr, avatar_report_error(wrong[i]), words[i]);
        t.row("avatar_report_passed", avatar_report_passed(wrong[i]) == 0);
        t.row("avatar_report_row", avatar_report_row(wrong[i], 0, &row) == 0 && avatar_report_row(wrong[i], 0, nullptr) == 0);
        avatar_report_close(wrong[i]);
    }
}

}  // namespace

int refused(const std::string& folder, Records& out) {
    const std::vector<uint8_t> file = read_file(folder + "/pack.avatar"), second = read_file(folder + "/other.avatar");
    AvatarPack* pack = avatar_open(file.data(), file.size(), "a.avatar", nullptr);
    AvatarPack* other = avatar_open(second.data(), second.size(), "b.avatar", nullptr);
    AvatarPack* broken = avatar_open(nullptr, 99, "nothing.avatar", nullptr);
    AvatarInstance* instance = avatar_instance_open(pack, 0, nullptr);
    AvatarInstance* bad = avatar_instance_open(pack, beyond, nullptr);
    Table table = {out};
    table.row("sound", avatar_error(pack) == nullptr && avatar_error(other) == nullptr && avatar_instance_error(instance) == nullptr);
    packs(table, pack, broken);
    no_instance(table, pack, bad);
    poses(table, pack, instance);
    cameras(table, instance);
    captures(table);
    passes(table, pack, other, instance);
    reports(table, pack);
    avatar_instance_close(bad);
    avatar_instance_close(instance);
    avatar_close(broken);
    avatar_close(other);
    avatar_close(pack);
    return 0;
}
