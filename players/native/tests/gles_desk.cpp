// Plays what tests ask for in files of commands: one context, one scene, one command a line. A test judges the images,
// the rows and the counts that it writes.
#include <EGL/egl.h>

#include <algorithm>
#include <chrono>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "../gles/avatar_gles.h"
#include "../play/egl.h"
#include "gles_refused.h"
#include "tools.h"

namespace {

[[noreturn]] void stop(const std::string& line) {
    std::fprintf(stderr, "%s\n", line.c_str());
    std::exit(3);
}

void must(int good, const char* line) {
    if (good == 0) stop(line != nullptr ? line : "failed without a line");
}

void write_file(const std::string& path, const void* from, size_t size) {
    std::ofstream(path, std::ios::binary).write(static_cast<const char*>(from), static_cast<std::streamsize>(size));
}

using Words = std::istringstream;

/// The next word of a line.
template <class T = std::string>
T next(Words& words) {
    T found = {};
    if (!(words >> found)) stop("a word is missing: " + words.str());
    return found;
}

struct Shown {
    AvatarPack* pack;
    AvatarInstance* instance;
};

struct Desk {
    Counter counted;
    AvatarAllocator allocator = counted.allocator();
    EglContext egl;
    bool is_es = true;
    AvatarGles* gles = nullptr;
    std::map<std::string, AvatarPack*> packs;
    std::vector<Shown> shown;
    AvatarCamera camera = {};
};

/// Functions of GL that the tests themselves need.
template <class... Parameters>
void call(const char* name, Parameters... parameters) {
    reinterpret_cast<void (*)(Parameters...)>(eglGetProcAddress(name))(parameters...);
}

// What a device of less may say: extensions that `hide` names are not there.
std::vector<std::string> hidden;
using Texts = const uint8_t* (*)(uint32_t, uint32_t);

const uint8_t* shown_extension(uint32_t name, uint32_t index) {
    const uint8_t* found = reinterpret_cast<Texts>(eglGetProcAddress("glGetStringi"))(name, index);
    for (const std::string& one : hidden) {
        if (found != nullptr && one == reinterpret_cast<const char*>(found)) return reinterpret_cast<const uint8_t*>("");
    }
    return found;
}

AvatarGlesFunction load(const char* name) {
    if (std::strcmp(name, "glGetStringi") == 0) return reinterpret_cast<AvatarGlesFunction>(&shown_extension);
    return eglGetProcAddress(name);
}

/// begin es|gl [WIDTH HEIGHT]: a context and a scene.
void begin(Desk& desk, Words& words) {
    desk.is_es = next(words) == "es";
    int width = 256, height = 256;
    words >> width >> height;
    const char* line = open_egl(desk.egl, desk.is_es, words ? width : 256, words ? height : 256);
    must(line == nullptr, line);
    desk.gles = avatar_gles_open(&load, &desk.allocator);
    must(avatar_gles_error(desk.gles) == nullptr, avatar_gles_error(desk.gles));
}

void take(const Bytes& file, size_t& at, void* into, size_t size) {
    if (at + size > file.size()) stop("a pose is too short");
    std::memcpy(into, &file[at], size);
    at += size;
}

/// A pose: weights [K] and [L] as float32; joints [J, 4, 4], its movement and its place as float64.
void set_pose(const Shown& one, const Bytes& file) {
    AvatarFacts facts;
    avatar_facts(one.pack, &facts);
    size_t at = 0;
    take(file, at, avatar_expression_weights(one.instance), 4 * size_t{facts.expressions});
    take(file, at, avatar_eyelid_weights(one.instance), 4 * size_t{facts.eyelids});
    take(file, at, avatar_joint_delta(one.instance), 128 * size_t{facts.joints});
    take(file, at, avatar_world_from_avatar(one.instance), 128);
    take(file, at, avatar_place(one.instance), 128);
    if (at != file.size()) stop("a pose is too long");
}

/// add PACK LEVEL POSE
void add(Desk& desk, Words& words) {
    const std::string path = next(words);
    const unsigned level = next<unsigned>(words);
    AvatarPack*& pack = desk.packs[path];
    if (pack == nullptr) {
        const Bytes file = read_file(path);
        pack = avatar_load(file.data(), file.size(), path.c_str(), &desk.allocator);
        must(avatar_error(pack) == nullptr, avatar_error(pack));
    }
    const Shown one = {pack, avatar_instance_open(pack, level, &desk.allocator)};
    must(avatar_instance_error(one.instance) == nullptr, avatar_instance_error(one.instance));
    set_pose(one, read_file(next(words)));
    desk.shown.push_back(one);
    must(avatar_gles_add(desk.gles, pack, one.instance), avatar_gles_error(desk.gles));
}

void clear(Desk& desk) {
    for (const Shown& one : desk.shown) {
        must(avatar_gles_remove(desk.gles, one.instance), avatar_gles_error(desk.gles));
        avatar_instance_close(one.instance);
    }
    desk.shown.clear();
}

void draw(Desk& desk, const AvatarGlesDepth* depth) {
    must(avatar_gles_pose(desk.gles), avatar_gles_error(desk.gles));
    must(avatar_gles_draw(desk.gles, &desk.camera, depth), avatar_gles_error(desk.gles));
}

void save(Desk& desk, const std::string& path) {
    std::vector<float> image(4 * static_cast<size_t>(desk.camera.width) * static_cast<size_t>(desk.camera.height));
    must(avatar_gles_read(desk.gles, image.data()), avatar_gles_error(desk.gles));
    write_file(path, image.data(), 4 * image.size());
}

uint32_t texture_of(uint32_t format, int width, int height) {
    uint32_t made = 0;
    call("glGenTextures", 1, &made);
    call("glBindTexture", 0x0DE1u, made);
    call("glTexStorage2D", 0x0DE1u, 1, format, width, height);
    return made;
}

/// depth FILE REVERSED OUT: the image behind a depth texture of float32, first row at the bottom.
void draw_behind(Desk& desk, Words& words) {
    const Bytes file = read_file(next(words));
    AvatarGlesDepth depth = {sizeof(AvatarGlesDepth), 0, next<int>(words)};
    depth.texture = texture_of(0x8CACu, desk.camera.width, desk.camera.height);  // DEPTH_COMPONENT32F
    call("glTexSubImage2D", 0x0DE1u, 0, 0, 0, desk.camera.width, desk.camera.height, 0x1902u, 0x1406u,
         static_cast<const void*>(file.data()));
    draw(desk, &depth);
    save(desk, next(words));
    call("glDeleteTextures", 1, static_cast<const uint32_t*>(&depth.texture));
}

/// composite LINEAR BACKGROUND OUT: a framebuffer of bytes of the caller's, which was grey. BACKGROUND "-": none.
void composite(Desk& desk, Words& words) {
    const int width = desk.camera.width, height = desk.camera.height, linear = next<int>(words);
    const std::string background = next(words);
    const uint32_t texture = texture_of(0x8058u, width, height);  // RGBA8
    uint32_t framebuffer = 0;
    call("glGenFramebuffers", 1, &framebuffer);
    call("glBindFramebuffer", 0x8D40u, framebuffer);
    call("glFramebufferTexture2D", 0x8D40u, 0x8CE0u, 0x0DE1u, texture, 0);
    const float grey[] = {0.5f, 0.5f, 0.5f, 1}, blue[] = {0.25f, 0.5f, 1};
    call("glClearBufferfv", 0x1800u, 0, static_cast<const float*>(grey));
    draw(desk, nullptr);
    must(avatar_gles_composite(desk.gles, framebuffer, background == "-" ? nullptr : blue, linear), avatar_gles_error(desk.gles));
    Bytes read(4 * static_cast<size_t>(width) * static_cast<size_t>(height));
    call("glReadPixels", 0, 0, width, height, 0x1908u, 0x1401u, static_cast<void*>(read.data()));
    write_file(next(words), read.data(), read.size());
    call("glDeleteFramebuffers", 1, static_cast<const uint32_t*>(&framebuffer));
    call("glDeleteTextures", 1, &texture);
}

/// conform FOLDER NAME: prints a row of each output of a reference.
void conform(Desk& desk, Words& words) {
    const std::string folder = next(words), cases_name = next(words);
    const Bytes mini = read_file(folder + "/mini.avatar"), cases = read_file(folder + "/" + cases_name + ".json");
    const Bytes vectors = read_file(folder + "/" + (cases_name == "cases" ? "vectors" : cases_name) + ".safetensors");
    AvatarPack* pack = avatar_load(mini.data(), mini.size(), "mini.avatar", &desk.allocator);
    AvatarStageRunner runner;
    must(avatar_gles_stage_runner(desk.gles, &runner), avatar_gles_error(desk.gles));
    AvatarReport* report = avatar_conform(pack, reinterpret_cast<const char*>(cases.data()), cases.size(), vectors.data(), vectors.size(), &runner,
                                          &desk.allocator);
    if (const char* line = avatar_report_error(report)) {
        const char* own = avatar_gles_error(desk.gles);
        stop(std::string(line) + "; " + (own != nullptr ? own : ""));
    }
    AvatarReportRow row;
    for (uint32_t i = 0; avatar_report_row(report, i, &row) == AVATAR_OK; i++) {
        std::printf("row %s %s %s %.9g %d\n", row.name, row.stage, row.output, row.used, row.passed);
    }
    std::printf("passed %d\n", avatar_report_passed(report));
    avatar_report_close(report);
    avatar_close(pack);
}

long resident_pages() {
    long total = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> total >> resident;
    return resident;
}

/// frames COUNT: as many frames, each of another pose. Prints our allocations, and by how many pages of memory the quarter
/// that grew least grew, the first left out: what is lost each frame is lost in every quarter, a driver's own growth is
/// not.
void frames(Desk& desk, Words& words) {
    const int count = next<int>(words);
    draw(desk, nullptr);
    const size_t before = desk.counted.calls;
    long pages = 0, least = LONG_MAX;
    for (int i = 0; i <= count; i++) {
        if (i > 0 && i % (count / 4) == 0) {
            call("glFinish");
            const long now = resident_pages();
            if (i > count / 4) least = std::min(least, now - pages);
            pages = now;
        }
        if (i == count) break;
        for (const Shown& one : desk.shown) avatar_place(one.instance)[3] = 0.001 * (i % 7);
        draw(desk, nullptr);
        must(avatar_gles_composite(desk.gles, 0, nullptr, 0), avatar_gles_error(desk.gles));
    }
    std::printf("allocations %zu\npages %ld\n", desk.counted.calls - before, least);
}

/// bench COUNT POSE...: milliseconds a frame, of the CPU and of the wall, each frame with the next of the poses.
void bench(Desk& desk, Words& words) {
    const int count = next<int>(words);
    std::vector<Bytes> poses;
    for (std::string path; words >> path;) poses.push_back(read_file(path));
    std::clock_t cpu = 0;
    std::chrono::steady_clock::time_point wall;
    for (int i = -3; i < count; i++) {  // the first ones compile
        if (i == 0) call("glFinish");
        if (i == 0) cpu = std::clock(), wall = std::chrono::steady_clock::now();
        for (const Shown& one : desk.shown) set_pose(one, poses[static_cast<size_t>(i + 3) % poses.size()]);
        draw(desk, nullptr);
        must(avatar_gles_composite(desk.gles, 0, nullptr, 0), avatar_gles_error(desk.gles));
    }
    call("glFinish");
    const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - wall;
    std::printf("bench %.3f %.3f %s\n", 1000.0 * static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC / count,
                passed.count() / count, avatar_gles_renderer(desk.gles));
}

/// depth_of MATRICES OUT: the camera of an engine's view and projection, with its depth.
void depth_of(Desk&, Words& words) {
    double matrices[32];
    std::memcpy(matrices, read_file(next(words)).data(), sizeof matrices);
    AvatarCamera camera;
    const char* line = avatar_camera_opengl(&camera, matrices, matrices + 16, 64, 48);
    must(line == nullptr, line);
    line = avatar_gles_camera_depth(&camera, matrices, matrices + 16);
    must(line == nullptr, line);
    write_file(next(words), &camera, sizeof camera);
}

/// lose: another context, and the scene goes on in it.
void lose(Desk& desk) {
    close_egl(desk.egl);
    avatar_gles_forget(desk.gles);
    const int refused = avatar_gles_pose(desk.gles);
    std::printf("lost %d %s\n", refused, avatar_gles_error(desk.gles));
    const char* line = open_egl(desk.egl, desk.is_es, 256, 256);
    must(line == nullptr, line);
    must(avatar_gles_restore(desk.gles), avatar_gles_error(desk.gles));
}

/// end: closes everything and prints the bytes that are left.
void end(Desk& desk) {
    avatar_gles_close(desk.gles);
    for (const Shown& one : desk.shown) avatar_instance_close(one.instance);
    for (const auto& [name, pack] : desk.packs) avatar_close(pack);
    close_egl(desk.egl);
    std::printf("left %zu\n", desk.counted.bytes);
    desk.gles = nullptr;
    desk.shown.clear();
    desk.packs.clear();
    hidden.clear();
}

const Shown& shown(Desk& desk, Words& words) { return desk.shown.at(next<size_t>(words)); }

void set_target(Desk& desk, Words& words) {
    const uint32_t target = next<uint32_t>(words);
    std::printf("target %u %d\n", target, avatar_gles_set_target(desk.gles, target));
}

void add_again(Desk& desk, Words&) {
    const Shown& one = desk.shown.at(0);
    const int good = avatar_gles_add(desk.gles, one.pack, one.instance);
    std::printf("twice %d %s\n", good, avatar_gles_error(desk.gles));
}

/// refused PACK: what cannot be used is refused. The pack is another one than that of the scene.
void refused(Desk& desk, Words& words) {
    const Bytes file = read_file(next(words));
    AvatarPack* other = avatar_load(file.data(), file.size(), "other.avatar", nullptr);
    const uint32_t textures[] = {texture_of(0x8058u, desk.camera.width, desk.camera.height), texture_of(0x8CACu, 3, 2)};  // RGBA8, depth
    const Shown& one = desk.shown.at(0);
    refused_arguments(desk.gles, desk.camera, one.pack, one.instance, other, textures[0], textures[1]);
    call("glDeleteTextures", 2, static_cast<const uint32_t*>(textures));
    avatar_close(other);
}

/// What a job may say, by its first word.
const std::map<std::string, void (*)(Desk&, Words&)> commands = {
    {"begin", &begin},
    {"hide", [](Desk&, Words& words) { hidden.push_back(next(words)); }},
    {"target", &set_target},
    {"which", [](Desk& desk, Words&) { std::printf("which %u\n", avatar_gles_target(desk.gles)); }},
    {"add", &add},
    {"twice", &add_again},
    {"pose", [](Desk& desk, Words& words) { const Shown& one = shown(desk, words); set_pose(one, read_file(next(words))); }},
    {"show", [](Desk& desk, Words& words) {
         const Shown& one = shown(desk, words);
         must(avatar_gles_show(desk.gles, one.instance, next<int>(words)), avatar_gles_error(desk.gles));
     }},
    {"level", [](Desk& desk, Words& words) {
         const Shown& one = shown(desk, words);
         must(avatar_set_level(one.instance, next<uint32_t>(words)), avatar_instance_error(one.instance));
     }},
    {"clear", [](Desk& desk, Words&) { clear(desk); }},
    {"camera", [](Desk& desk, Words& words) { std::memcpy(&desk.camera, read_file(next(words)).data(), sizeof desk.camera); }},
    {"draw", [](Desk& desk, Words& words) { draw(desk, nullptr), save(desk, next(words)); }},
    {"seen", [](Desk& desk, Words& words) {  // as it was posed for the last image
         must(avatar_gles_draw(desk.gles, &desk.camera, nullptr), avatar_gles_error(desk.gles));
         save(desk, next(words));
     }},
    {"depth", &draw_behind},
    {"depth_of", &depth_of},
    {"composite", &composite},
    {"conform", &conform},
    {"frames", &frames},
    {"early", [](Desk& desk, Words&) { refused_early(desk.gles); }},
    {"refused", &refused},
    {"bench", &bench},
    {"lose", [](Desk& desk, Words&) { lose(desk); }},
    {"end", [](Desk& desk, Words&) { end(desk); }},
};

}  // namespace

int main(int count, char** words) {
    Desk desk;
    std::ifstream job(count > 1 ? words[1] : "");
    for (std::string text; std::getline(job, text);) {
        std::istringstream line(text);
        std::string word;
        line >> word;
        const auto found = commands.find(word);
        if (found == commands.end()) stop("no such command: " + word);
        found->second(desk, line);
    }
    return 0;
}
