// Loads a pack, moves it, and writes what it looks like: the whole of what a host does. Read main from its beginning.
//
// Four steps:
//   1. avatar_load, avatar_instance_open        a pack, and one avatar of it                     (avatar_player.h)
//   2. avatar_gles_open, avatar_gles_add        its buffers and programs in our GL context       (avatar_gles.h)
//   3. each frame: write the pose; avatar_gles_pose; avatar_gles_draw; avatar_gles_composite
//   4. close everything, in the other order
// Steps 2 and 3 are in gl_screen.cpp, and in d3d11_screen.cpp the same with avatar_d3d11_open and so on (avatar_d3d11.h).
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "../src/formats/text.h"
#include "files.h"
#include "light_file.h"
#include "options.h"
#include "png.h"
#include "screen.h"

namespace {

constexpr double degree = 3.14159265358979323846 / 180;
constexpr double field_of_view = 30 * degree;  // vertical
constexpr float background[3] = {0, 0, 0};     // display-referred

/// Prints a line, such as that of a handle, and says that it failed.
bool failed(const char* line) {
    std::fprintf(stderr, "%s\n", line);
    return false;
}

bool read_file(const std::string& path, std::string& into) {
    std::FILE* file = open_file(path, "rb");
    if (file == nullptr) return failed((path + ": cannot be read").c_str());
    char part[65536];
    for (size_t size; (size = std::fread(part, 1, sizeof part, file)) > 0;) into.append(part, size);
    std::fclose(file);
    return true;
}

/// Everything that is open. A handle is NULL until then; closing NULL does nothing.
struct Player {
    AvatarPack* pack = nullptr;
    AvatarInstance* instance = nullptr;
    AvatarRecording* recording = nullptr;
    std::unique_ptr<PlayScreen> screen;
    int clip = -1;

    ~Player() {
        screen.reset();
        avatar_recording_close(recording);
        avatar_instance_close(instance);
        avatar_close(pack);
    }
};

/// Milliseconds of the stages of all frames, in the order in which they come.
struct Timings {
    struct Stage {
        std::string name;
        double ms;
    };
    using Clock = std::chrono::steady_clock;

    std::vector<Stage> stages;
    Clock::time_point last = Clock::now();

    void begin_frame() { last = Clock::now(); }

    /// What the clock of a scene calls, when the GPU has finished a stage.
    static void ended(void* user, const char* stage) {
        Timings* self = static_cast<Timings*>(user);
        const Clock::time_point now = Clock::now();
        const double ms = std::chrono::duration<double, std::milli>(now - self->last).count();
        self->last = now;
        for (Stage& one : self->stages) {
            if (one.name == stage) {
                one.ms += ms;
                return;
            }
        }
        self->stages.push_back({stage, ms});
    }

    void print(int frames) const {
        double sum = 0;
        for (const Stage& one : stages) {
            std::printf("%-12s %8.3f ms a frame\n", one.name.c_str(), one.ms / frames);
            sum += one.ms / frames;
        }
        std::printf("%-12s %8.3f ms a frame\n", "all", sum);
    }
};

/// Step 1: the pack is loaded and checked; then an instance of it is opened.
bool open_avatar(const Options& options, Player& player) {
    std::string file;
    if (!read_file(options.pack, file)) return false;
    player.pack = avatar_load(file.data(), file.size(), options.pack.c_str(), nullptr);
    if (const char* line = avatar_error(player.pack)) return failed(line);
    player.instance = avatar_instance_open(player.pack, options.level, nullptr);
    if (const char* line = avatar_instance_error(player.instance)) return failed(line);
    return true;
}

/// In which light it stands.
bool set_light(const Options& options, const Player& player) {
    if (options.light.empty()) return true;
    std::string text;
    if (!read_file(options.light, text)) return false;
    AvatarLight light = {};
    const std::string line = read_light(text, options.light, light);
    if (!line.empty()) return failed(line.c_str());
    return avatar_set_light(player.instance, &light) == AVATAR_OK || failed(avatar_instance_error(player.instance));
}

/// What moves it: a clip of the pack, or a recording of a face.
bool open_motion(const Options& options, Player& player) {
    AvatarClip clip;
    std::string names;
    for (uint32_t i = 0; !options.clip.empty() && avatar_clip(player.pack, i, &clip) == AVATAR_OK; i++) {
        if (options.clip == clip.name) player.clip = static_cast<int>(i);
        names += (i > 0 ? ", " : "") + std::string(avatar::Cut(clip.name, 80).data);  // a terminal obeys control letters
    }
    if (!options.clip.empty() && player.clip < 0) {
        return failed((options.pack + ": has no clip " + options.clip + "; it has " + (names.empty() ? "none" : names)).c_str());
    }
    if (options.recording.empty()) return true;
    std::string text;
    if (!read_file(options.recording, text)) return false;
    player.recording = avatar_recording_open(text.data(), text.size(), options.recording.c_str(), nullptr);
    if (const char* line = avatar_recording_error(player.recording)) return failed(line);
    if (avatar_enable_driving(player.instance, 1) == AVATAR_OK) return true;
    return failed(avatar_instance_error(player.instance));
}

/// Step 2: the avatar goes into our context.
bool open_scene(const Options& options, Player& player) {
    player.screen = options.api == "d3d11" ? make_d3d11_screen() : make_gl_screen();
    if (player.screen == nullptr) return failed(("--api " + options.api + ": this avatar_play was built without it").c_str());
    if (const char* line = player.screen->open(options)) return failed(line);
    return player.screen->add(player.pack, player.instance) || failed(player.screen->error());
}

/// Writes the pose of a time.
bool set_pose(const Options& options, const Player& player, double seconds) {
    avatar_reset_pose(player.instance);
    int good = AVATAR_OK;
    if (player.clip >= 0) good = avatar_clip_pose(player.instance, static_cast<uint32_t>(player.clip), seconds);
    if (player.recording != nullptr) {
        AvatarFrame frame;
        good = avatar_recording_sample(player.recording, seconds, &frame);
        if (good != 0) good = avatar_drive(player.instance, &frame);
    }
    for (const auto& [name, weight] : options.expressions) {
        if (good != 0) good = avatar_set_expression(player.instance, name.c_str(), weight);
    }
    return good != 0 || failed(avatar_instance_error(player.instance));
}

/// A camera that sees the whole avatar. The pack says where its middle is, how large it is and where it looks.
bool aim(const Options& options, const AvatarPack* pack, AvatarCamera& camera) {
    AvatarFacts facts;
    avatar_facts(pack, &facts);
    const double *u = facts.up, *f = facts.front, *size = facts.whole_size;
    const double r[] = {u[1] * f[2] - u[2] * f[1], u[2] * f[0] - u[0] * f[2], u[0] * f[1] - u[1] * f[0]};
    const double sy = std::sin(options.yaw * degree), cy = std::cos(options.yaw * degree);
    const double sp = std::sin(options.pitch * degree), cp = std::cos(options.pitch * degree);
    const double needed = std::fmax(size[1], size[0] * options.height / options.width);
    const double distance = 0.55 * needed / std::tan(field_of_view / 2) + 0.5 * size[2];
    double rotation[9], translation[3] = {0, 0, distance};  // rows: right, down, forward
    for (int i = 0; i < 3; i++) {
        rotation[i] = cy * r[i] - sy * f[i];
        rotation[3 + i] = sp * (sy * r[i] + cy * f[i]) - cp * u[i];
        rotation[6 + i] = -cp * (sy * r[i] + cy * f[i]) - sp * u[i];
    }
    for (int i = 0; i < 9; i++) translation[i / 3] -= rotation[i] * facts.whole_target[i % 3];
    const double focal = options.height / (2 * std::tan(field_of_view / 2));
    const double intrinsics[] = {focal, 0, options.width / 2.0, 0, focal, options.height / 2.0, 0, 0, 1};
    const char* line = avatar_camera_opencv(&camera, rotation, translation, intrinsics, options.width, options.height);
    return line == nullptr || failed(line);
}

bool save_frame(PlayScreen& screen, const std::string& path, int width, int height) {
    std::vector<uint8_t> rgba;
    if (!screen.read(rgba)) return failed("the frame cannot be read");
    const bool good = write_png(path, rgba.data(), static_cast<uint32_t>(width), static_cast<uint32_t>(height));
    return good || failed((path + ": cannot be written").c_str());
}

/// Plays all frames; in a window until it is closed.
bool play(const Options& options, const Player& player) {
    AvatarCamera camera;
    if (!aim(options, player.pack, camera)) return false;
    PlayScreen& screen = *player.screen;
    Timings timings;
    if (options.timings) screen.set_clock(&Timings::ended, &timings);
    AvatarClip clip = {};
    if (player.clip >= 0) avatar_clip(player.pack, static_cast<uint32_t>(player.clip), &clip);
    int frame = 0, timed = 0;
    for (bool open = true; options.window ? open : frame < options.frames; frame++) {
        double seconds = frame / options.fps;
        if (options.window && clip.seconds > 0) seconds = std::fmod(seconds, clip.seconds);
        if (!set_pose(options, player, seconds)) return false;
        timings.begin_frame();
        if (!screen.draw(camera, background)) return failed(screen.error());
        timed++;
        if (frame == 0 && options.frames > 1) timings.stages.clear(), timed = 0;  // drivers compile in the first frame
        if (options.window) open = screen.show();
        if (!options.out.empty() && !save_frame(screen, frame_name(options.out, frame), options.width, options.height)) return false;
    }
    if (options.timings && timed > 0) timings.print(timed);
    return true;
}

}  // namespace

int main(int count, char** words) {
    Options options;
    if (!parse(words_of(count, words), options)) return 2;
    Player player;
    bool good = open_avatar(options, player) && set_light(options, player) && open_motion(options, player) && open_scene(options, player);
    static const char* const targets[] = {"RGBA32F", "RGBA16F", "RGBA8"};
    if (good) std::printf("%s, splats blended in %s\n", player.screen->renderer(), targets[player.screen->target()]);
    good = good && play(options, player);
    return good ? 0 : 2;  // step 4 is ~Player
}
