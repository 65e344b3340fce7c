// Loads a pack, moves it, and writes what it looks like: the whole of what a host does. Read main from its beginning.
//
// Four steps:
//   1. avatar_load, avatar_instance_open        a pack, and one avatar of it                     (avatar_player.h)
//   2. avatar_gles_open, avatar_gles_add        its buffers and programs in our GL context       (avatar_gles.h)
//   3. each frame: write the pose; avatar_gles_pose; avatar_gles_draw; avatar_gles_composite
//   4. close everything, in the other order
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "../gles/avatar_gles.h"
#include "../src/formats/text.h"
#include "egl.h"
#include "options.h"
#include "png.h"
#include "window.h"

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
    FILE* file = std::fopen(path.c_str(), "rb");
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
    AvatarGles* gles = nullptr;
    int clip = -1;

    ~Player() {
        avatar_gles_close(gles);  // its context must still be current
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

    /// What avatar_gles_set_clock calls, when the GPU has finished a stage.
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
    player.gles = avatar_gles_open(eglGetProcAddress, nullptr);
    bool good = avatar_gles_error(player.gles) == nullptr;
    if (good && options.target >= 0) good = avatar_gles_set_target(player.gles, static_cast<uint32_t>(options.target)) != 0;
    if (good) good = avatar_gles_add(player.gles, player.pack, player.instance) != 0;
    return good || failed(avatar_gles_error(player.gles));
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

/// Step 3: one frame onto framebuffer 0.
bool draw_frame(const Player& player, const AvatarCamera& camera) {
    const bool good = avatar_gles_pose(player.gles) && avatar_gles_draw(player.gles, &camera, nullptr) &&
                      avatar_gles_composite(player.gles, 0, background, 0);
    return good || failed(avatar_gles_error(player.gles));
}

/// Reads framebuffer 0 and writes it. GL has the last row first.
bool save_frame(const std::string& path, int width, int height) {
    using ReadPixels = void (*)(int, int, int, int, unsigned, unsigned, void*);
    const auto read_pixels = reinterpret_cast<ReadPixels>(eglGetProcAddress("glReadPixels"));
    const size_t row = 4 * static_cast<size_t>(width), rows = static_cast<size_t>(height);
    std::vector<uint8_t> read(row * rows), turned(row * rows);
    read_pixels(0, 0, width, height, 0x1908 /* GL_RGBA */, 0x1401 /* GL_UNSIGNED_BYTE */, read.data());
    for (size_t y = 0; y < rows; y++) std::memcpy(&turned[row * y], &read[row * (rows - 1 - y)], row);
    const bool good = write_png(path.c_str(), turned.data(), static_cast<uint32_t>(width), static_cast<uint32_t>(height));
    return good || failed((path + ": cannot be written").c_str());
}

/// Plays all frames; in a window until it is closed.
bool play(const Options& options, const Player& player, const EglContext& egl, PlayWindow* window) {
    AvatarCamera camera;
    if (!aim(options, player.pack, camera)) return false;
    Timings timings;
    if (options.timings) avatar_gles_set_clock(player.gles, &Timings::ended, &timings);
    AvatarClip clip = {};
    if (player.clip >= 0) avatar_clip(player.pack, static_cast<uint32_t>(player.clip), &clip);
    int frame = 0, timed = 0;
    for (; window != nullptr ? window_is_open(window) : frame < options.frames; frame++) {
        double seconds = frame / options.fps;
        if (window != nullptr && clip.seconds > 0) seconds = std::fmod(seconds, clip.seconds);
        if (!set_pose(options, player, seconds)) return false;
        timings.begin_frame();
        if (!draw_frame(player, camera)) return false;
        timed++;
        if (frame == 0 && options.frames > 1) timings.stages.clear(), timed = 0;  // drivers compile in the first frame
        if (window != nullptr) eglSwapBuffers(egl.display, egl.surface);
        if (!options.out.empty() && !save_frame(frame_name(options.out, frame), options.width, options.height)) return false;
    }
    if (options.timings && timed > 0) timings.print(timed);
    return true;
}

}  // namespace

int main(int count, char** words) {
    Options options;
    if (!parse(count, words, options)) return 2;
    EglContext egl;
    PlayWindow* window = nullptr;
    const char* line = options.window ? open_window(window, egl, options.es, options.width, options.height)
                                      : open_egl(egl, options.es, options.width, options.height);
    bool good = line == nullptr || failed(line);
    if (good) {
        Player player;
        good = open_avatar(options, player) && open_motion(options, player) && open_scene(options, player);
        static const char* const targets[] = {"RGBA32F", "RGBA16F", "RGBA8"};
        if (good) std::printf("%s, splats blended in %s\n", avatar_gles_renderer(player.gles), targets[avatar_gles_target(player.gles)]);
        good = good && play(options, player, egl, window);
    }  // step 4: everything is closed while the context is current
    close_egl(egl);
    close_window(window);
    return good ? 0 : 2;
}
