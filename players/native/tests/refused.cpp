// What the functions of avatar_player.h make of NULL, of numbers that are not finite, of what is not there, and of calls in
// the wrong order: each refuses it, with a line where its handle can hold one, and changes nothing.
#include <cstring>
#include <initializer_list>
#include <limits>
#include <type_traits>

#include "avatar_light.h"
#include "checks.h"

namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
constexpr double bad_numbers[] = {nan_value, infinity, -infinity, 1e300};
constexpr uint32_t beyond = 4000000000u;

/// Whether a type is a struct of the header, and no handle.
template <class T, class = void>
struct is_struct : std::false_type {};
template <class T>
struct is_struct<T, std::void_t<decltype(T::struct_size)>> : std::true_type {};

template <class T>
T* empty_struct() {
    static T made;
    made = T{};
    return &made;
}

struct Table {
    Records& out;
    size_t rows = 0;

    /// A row: `good` is whether it was refused; `line` must hold `words`, in one line. `words` NULL: there is no line.
    void row(const char* what, bool good, const char* line = nullptr, const char* words = nullptr) {
        const bool named = words == nullptr || (line != nullptr && std::strstr(line, words) != nullptr && std::strchr(line, '\n') == nullptr);
        const std::string said = std::string(good ? "" : "was not refused; ") + (named ? "" : line != nullptr ? line : "no line");
        out.text(std::to_string(rows++) + " " + what, good && named ? "" : said.c_str());
    }

    /// Calls functions of a handle with what no function takes: numbers beyond all, NaN, NULL. They must give nothing.
    template <class Handle, class... Functions>
    void call(const char* names, Handle* handle, Functions... functions) {
        (one(names, functions, handle), ...);
    }

private:
    template <class R, class Handle, class... More>
    void one(const char* what, R (*function)(Handle*, More...), const std::remove_const_t<Handle>* handle) {
        Handle* own = const_cast<Handle*>(handle);
        if constexpr (std::is_void_v<R>) function(own, worst<More>()...);
        else row(what, is_nothing(function(own, worst<More>()...)));
    }
    template <class T>
    static T worst() {
        if constexpr (std::is_same_v<T, uint32_t>) return beyond;
        else if constexpr (std::is_same_v<T, double>) return nan_value;
        else if constexpr (is_struct<std::remove_pointer_t<T>>::value) return empty_struct<std::remove_cv_t<std::remove_pointer_t<T>>>();
        else return T{};
    }
    template <class R>
    static bool is_nothing(R given) {
        if constexpr (std::is_same_v<R, double>) return given == infinity;
        else if constexpr (std::is_signed_v<R>) return given == 0 || given == -1;
        else return given == R{};
    }
};

#define CALL(handle, ...) t.call(#__VA_ARGS__, handle, __VA_ARGS__)

void packs(Table& t, const AvatarPack* pack, const AvatarPack* broken) {
    t.row("avatar_load NULL", avatar_error(broken) != nullptr, avatar_error(broken), "nothing.avatar: is not a pack");
    const AvatarAllocator empty = {sizeof(AvatarAllocator), nullptr, nullptr, nullptr};
    t.row("avatar_load allocator", avatar_load("", 0, nullptr, &empty) == nullptr);
    avatar_close(nullptr);
    t.row("avatar_error NULL", avatar_error(nullptr) != nullptr, avatar_error(nullptr), "NULL");
    for (const AvatarPack* one : {static_cast<const AvatarPack*>(nullptr), broken, pack}) {
        CALL(one, avatar_expression_name, avatar_expression_alias, avatar_eyelid_name, avatar_joint_name,
             avatar_expression_range, avatar_group, avatar_clip, avatar_level, avatar_chunk, avatar_buffer, avatar_buffer_content,
             avatar_level_for, avatar_next_level);
        double low = 1, high = 1;
        avatar_expression_range(one, beyond, &low, &high);
        t.row("avatar_expression_range", low == 0 && high == 0);
        for (const char* name : {static_cast<const char*>(nullptr), "", "no such name", "\xff\xfe"}) {
            t.row("avatar_expression_index", avatar_expression_index(one, name) == -1);
            t.row("avatar_eyelid_index", avatar_eyelid_index(one, name) == -1);
            t.row("avatar_joint_index", avatar_joint_index(one, name) == -1);
            t.row("avatar_buffer_index", avatar_buffer_index(one, name) == -1);
        }
        AvatarChunk chunk;
        t.row("beyond one", avatar_expression_alias(one, 0, beyond) == nullptr && avatar_chunk(one, 0, beyond, &chunk) == 0);
        t.row("avatar_next_level", avatar_next_level(one, infinity, beyond) == 0);
        t.row("avatar_buffer_content", avatar_buffer_content(one, 0, nullptr) == 0);
        if (one == pack) continue;
        CALL(one, avatar_facts, avatar_joint_parents, avatar_rest_local, avatar_inverse_bind, avatar_triangles);
    }
    t.row("avatar_facts", empty_struct<AvatarFacts>()->name == nullptr);
}

/// The ways to make a camera, with arguments that are sound: the numbers of each argument behind those of the one before.
struct Made {
    const char* name;
    std::vector<double> given;
    const char* (*make)(AvatarCamera*, const double*);
};

const Made made_cameras[] = {
    {"avatar_camera_orbit", {0, 0, 0, 1, 0, 0, 0.8, 64, 48}, [](AvatarCamera* into, const double* g) {
         return avatar_camera_orbit(into, g, g[3], g[4], g[5], g[6], static_cast<int32_t>(g[7]), static_cast<int32_t>(g[8]));
     }},
    {"avatar_camera_opencv", {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 50, 0, 32, 0, 50, 24, 0, 0, 1, 64, 48}, [](AvatarCamera* into, const double* g) {
         return avatar_camera_opencv(into, g, g + 9, g + 12, static_cast<int32_t>(g[21]), static_cast<int32_t>(g[22]));
     }},
    {"avatar_camera_opengl", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -2, 0, 0, 0, 1, 1.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1, -0.2, 0, 0, -1, 0, 64, 48},
     [](AvatarCamera* into, const double* g) {
         return avatar_camera_opengl(into, g, g + 16, static_cast<int32_t>(g[32]), static_cast<int32_t>(g[33]));
     }}};

void cameras(Table& t, AvatarInstance* instance) {
    AvatarCamera camera, before;
    t.row("sound", made_cameras[0].make(&camera, made_cameras[0].given.data()) == nullptr);
    before = camera;
    const auto row = [&](const char* what, const char* line, const char* words) {
        t.row(what, line != nullptr && std::memcmp(&camera, &before, sizeof(camera)) == 0, line, words);
    };
    const struct {
        size_t how;
        const char* words;
        std::initializer_list<size_t> places;
        std::initializer_list<double> values;
    } wrong[] = {{0, "not finite", {1, 3, 4, 5}, {nan_value, infinity, -infinity, 1e300}},
                 {0, "fov_y", {6}, {nan_value, infinity, -infinity, 1e300, 0, -0.5, 3.15, 6}},
                 {0, "", {6}, {1e-320}},
                 {0, "1 to 32768", {7, 8}, {0, -1, INT32_MIN, 32769, INT32_MAX}},
                 {1, "not finite", {4, 11, 14}, {nan_value, infinity, -infinity, 1e300}},
                 {1, "rotation", {0}, {-1, 2}},
                 {1, "rotation", {1}, {0.5}},
                 {1, "intrinsics", {12, 16}, {0, -50}},
                 {1, "intrinsics", {15, 18, 19}, {1}},
                 {1, "intrinsics", {20}, {0}},
                 {1, "1 to 32768", {21}, {0}},
                 {2, "not finite", {3, 16}, {nan_value, infinity, -infinity, 1e300}},
                 {2, "not finite", {0}, {0}},
                 {2, "mirrors", {16}, {0}},
                 {2, "turns it over", {21}, {-2}},
                 {2, "perspective", {30}, {0}},
                 {2, "perspective", {31}, {1}},
                 {2, "1 to 32768", {32}, {-3}}};
    for (const auto& one : wrong) {
        for (const size_t at : one.places) {
            for (const double value : one.values) {
                std::vector<double> given = made_cameras[one.how].given;
                given[at] = value;
                row(made_cameras[one.how].name, made_cameras[one.how].make(&camera, given.data()), one.words);
            }
        }
    }
    for (const Made& one : made_cameras) row(one.name, one.make(nullptr, one.given.data()), "NULL");
    const double* g = made_cameras[1].given.data();
    row("orbit NULL", avatar_camera_orbit(&camera, nullptr, 1, 0, 0, 0.8, 64, 48), "NULL");
    row("opencv NULL", avatar_camera_opencv(&camera, nullptr, g, g, 64, 48), "NULL");
    row("opencv NULL", avatar_camera_opencv(&camera, g, nullptr, g, 64, 48), "NULL");
    row("opencv NULL", avatar_camera_opencv(&camera, g, g, nullptr, 64, 48), "NULL");
    row("opengl NULL", avatar_camera_opengl(&camera, nullptr, g, 64, 48), "NULL");
    row("opengl NULL", avatar_camera_opengl(&camera, g, nullptr, 64, 48), "NULL");

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

void no_instance(Table& t, AvatarInstance* bad) {
    for (AvatarInstance* one : {static_cast<AvatarInstance*>(nullptr), bad}) {
        const char* line = avatar_instance_error(one);
        t.row("avatar_instance_error", line != nullptr, line, one == nullptr ? "NULL" : "there is no level");
        CALL(one, avatar_reset_pose, avatar_set_expression, avatar_set_eyelid, avatar_set_joint,
             avatar_expression_weights, avatar_eyelid_weights, avatar_joint_delta, avatar_world_from_avatar,
             avatar_place, avatar_set_level, avatar_instance_level, avatar_clip_pose, avatar_enable_driving,
             avatar_drive, avatar_update_pose, avatar_update_camera, avatar_height_px, avatar_pose_floats,
             avatar_group_matrix, avatar_group_rotation, avatar_set_light, avatar_lighting);
    }
    t.row("avatar_instance_open NULL", avatar_instance_open(nullptr, 0, nullptr) == nullptr);
    avatar_instance_close(nullptr);
    AvatarPack* broken = avatar_load("xxxx", 4, nullptr, nullptr);
    AvatarInstance* of = avatar_instance_open(broken, 0, nullptr);
    t.row("avatar_instance_open broken", avatar_update_pose(of) == 0, avatar_instance_error(of), "could not be loaded");
    avatar_instance_close(of);
    avatar_close(broken);
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
    AvatarLight light = {};  // the pack is not relit
    t.row("avatar_set_light", avatar_set_light(instance, &light) == 0, line(), "pack --relight");
    light.struct_size = 0;
    t.row("avatar_set_light struct_size", avatar_set_light(instance, &light) == 0, line(), "struct_size");
    t.row("sound", avatar_set_light(instance, nullptr) == 1 && avatar_lighting(instance) == AVATAR_UNLIT);
    t.row("avatar_set_level", avatar_set_level(instance, beyond) == 0, line(), "there is no level");
    t.row("avatar_clip_pose", avatar_clip_pose(instance, beyond, 0) == 0, line(), "there is no clip");
    for (const double seconds : bad_numbers) t.row("sound time", avatar_clip_pose(instance, 0, seconds) == 1 && avatar_update_pose(instance) == 1);

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

/// Of a pack whose name is an escape, marks of direction and an end of a line.
void hostile_name(Table& t, const std::string& path) {
    const Bytes file = read_file(path);
    AvatarPack* pack = avatar_load(file.data(), file.size(), "\x1b[1m", nullptr);
    AvatarInstance* instance = avatar_instance_open(pack, 0, nullptr);
    t.row("hostile name", avatar_set_expression(instance, "\xe2\x80\xae", 1) == 0, avatar_instance_error(instance),
          "\\u001b[2J\\u202e\\u000a\\u009b: '\\u202e' is not an expression");
    AvatarPack* broken = avatar_load(file.data(), 9, "\x1b[1m\xe2\x81\xa6\xed\xa0\x80\xff", nullptr);
    t.row("hostile file", avatar_error(broken) != nullptr, avatar_error(broken), "\\u001b[1m\\u2066: is damaged");
    avatar_close(broken);
    avatar_instance_close(instance);
    avatar_close(pack);
}

void captures(Table& t) {
    AvatarFrame frame;
    t.row("avatar_arkit_name", avatar_arkit_name(61) == nullptr && avatar_arkit_name(beyond) == nullptr);
    t.row("avatar_arkit_channel", avatar_arkit_channel(nullptr) == -1 && avatar_arkit_channel("") == -1);
    t.row("avatar_read_packet", avatar_read_packet(nullptr, 9, &frame) == 0 && avatar_read_packet("\6", 1, nullptr) == 0);
    t.row("avatar_idle", avatar_idle(1, 2, nullptr) == AVATAR_FAILED && avatar_idle(infinity, 2, &frame) == AVATAR_FAILED);
    AvatarRecording* none = avatar_recording_open(nullptr, 12, nullptr, nullptr);
    t.row("avatar_recording_open NULL", avatar_recording_error(none) != nullptr, avatar_recording_error(none), "no text");
    t.row("avatar_recording_error NULL", avatar_recording_error(nullptr) != nullptr);
    for (AvatarRecording* one : {static_cast<AvatarRecording*>(nullptr), none}) {
        CALL(one, avatar_recording_facts, avatar_recording_sample);
        avatar_recording_close(one);
    }
}

void passes(Table& t, const AvatarPack* pack, const AvatarPack* other, AvatarInstance* instance) {
    AvatarPasses* const wrong[] = {nullptr, avatar_passes_open(nullptr, 0, 0, nullptr), avatar_passes_open(pack, beyond, 0, nullptr),
                                   avatar_passes_open(pack, 0, AVATAR_LIGHT + 1, nullptr)};
    for (AvatarPasses* one : wrong) {
        t.row("avatar_passes_open", avatar_passes_error(one) != nullptr);
        CALL(one, avatar_passes_count, avatar_passes_blocks, avatar_passes_keep_lasting, avatar_dispatch, avatar_binding, avatar_constant);
        t.row("avatar_passes_set", avatar_passes_set(one, instance) == 0);
        avatar_passes_close(one);
    }
    AvatarPasses* view = avatar_passes_open(pack, 0, AVATAR_VIEW, nullptr);
    AvatarInstance* of_other = avatar_instance_open(other, 0, nullptr);
    AvatarBinding binding;
    AvatarConstant constant;
    CALL(view, avatar_dispatch, avatar_binding, avatar_constant);
    t.row("beyond one", avatar_binding(view, 0, beyond, &binding) == 0 && avatar_constant(view, 0, beyond, &constant) == 0);
    t.row("avatar_passes_set NULL", avatar_passes_set(view, nullptr) == 0, avatar_passes_error(view), "no sound instance");
    t.row("avatar_passes_set other", avatar_passes_set(view, of_other) == 0, avatar_passes_error(view), "of another pack");
    avatar_passes_set(view, instance);
    t.row("sound", avatar_passes_error(view) == nullptr);
    avatar_instance_close(of_other);
    avatar_passes_close(view);

    constexpr uint32_t size = sizeof(AvatarSceneChunk);
    const AvatarSceneChunk nameless = {size, nullptr, 3}, many[] = {{size, "a", 4000000}, {size, "b", 4000000}}, few = {size, "a", 3};
    AvatarSort* const sorts[] = {nullptr, avatar_sort_open(nullptr, 2, nullptr), avatar_sort_open(&nameless, 1, nullptr), avatar_sort_open(many, 2, nullptr)};
    for (AvatarSort* one : sorts) {
        t.row("avatar_sort_open", avatar_sort_error(one) != nullptr);
        CALL(one, avatar_sort_count, avatar_sort_dispatches, avatar_sort_buffer);
        t.row("avatar_sort_passes", avatar_passes_count(avatar_sort_passes(one)) == 0);
        avatar_sort_close(one);
    }
    AvatarSort* sound = avatar_sort_open(&few, 1, nullptr);
    CALL(sound, avatar_sort_buffer);
    avatar_sort_close(sound);
    t.row("avatar_shader", avatar_shader(0, nullptr) == nullptr && avatar_shader(9, "blend") == nullptr && avatar_shader(0, "no") == nullptr);
    t.row("avatar_shader_at", avatar_shader_at(beyond, 0, nullptr) == nullptr && avatar_shader_at(0, beyond, nullptr) == nullptr);
    t.row("avatar_player_version", avatar_player_version() == AVATAR_PLAYER_VERSION);
}

void reports(Table& t, const AvatarPack* pack) {
    const AvatarStageRunner holes = {};
    const struct {
        const char* words;
        AvatarReport* made;
    } wrong[] = {{"NULL", nullptr},
                 {"could not be loaded", avatar_conform(nullptr, "{}", 2, "", 0, nullptr, nullptr)},
                 {"cases", avatar_conform(pack, nullptr, 9, "", 0, nullptr, nullptr)},
                 {"vectors", avatar_conform(pack, "{}", 2, nullptr, 9, nullptr, nullptr)},
                 {"runner", avatar_conform(pack, "{}", 2, "", 0, &holes, nullptr)},
                 {"cases", avatar_conform(pack, "{}", size_t{1} << 40, "", 0, nullptr, nullptr)}};
    for (const auto& one : wrong) {
        t.row("avatar_conform", avatar_report_error(one.made) != nullptr, avatar_report_error(one.made), one.words);
        CALL(one.made, avatar_report_passed, avatar_report_row);
        avatar_report_close(one.made);
    }
}

}  // namespace

int refused(const std::string& folder, Records& out) {
    const std::vector<uint8_t> file = read_file(folder + "/pack.avatar"), second = read_file(folder + "/other.avatar");
    AvatarPack* pack = avatar_load(file.data(), file.size(), "a.avatar", nullptr);
    AvatarPack* other = avatar_load(second.data(), second.size(), "b.avatar", nullptr);
    AvatarPack* broken = avatar_load(nullptr, 99, "nothing.avatar", nullptr);
    AvatarInstance* instance = avatar_instance_open(pack, 0, nullptr);
    AvatarInstance* bad = avatar_instance_open(pack, beyond, nullptr);
    Table table = {out};
    table.row("sound", avatar_error(pack) == nullptr && avatar_error(other) == nullptr && avatar_instance_error(instance) == nullptr);
    packs(table, pack, broken);
    no_instance(table, bad);
    poses(table, pack, instance);
    cameras(table, instance);
    hostile_name(table, folder + "/hostile.avatar");
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
