// Plays what tests ask for in files of commands: one screen, one scene, one command a line. A test judges the images,
// the rows and the counts that it writes.
#include <algorithm>
#include <chrono>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "avatar_light.h"
#include "desk.h"

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
    std::string kind;
    AvatarScene* scene = nullptr;
    std::map<std::string, AvatarPack*> packs;
    std::vector<Shown> shown;
    AvatarCamera camera = {};
};

/// begin es|gl|d3d11 [WIDTH HEIGHT]: a screen and a scene.
void begin(Desk& desk, Words& words) {
    desk.kind = next(words);
    int width = 256, height = 256;
    words >> width >> height;
    const char* line = open_screen(desk.kind, words ? width : 256, words ? height : 256);
    must(line == nullptr, line);
    desk.scene = open_scene(desk.allocator);
    must(VERB(error)(desk.scene) == nullptr, VERB(error)(desk.scene));
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
    must(VERB(add)(desk.scene, pack, one.instance), VERB(error)(desk.scene));
}

void clear(Desk& desk) {
    for (const Shown& one : desk.shown) {
        must(VERB(remove)(desk.scene, one.instance), VERB(error)(desk.scene));
        avatar_instance_close(one.instance);
    }
    desk.shown.clear();
}

void draw(Desk& desk) {
    must(VERB(pose)(desk.scene), VERB(error)(desk.scene));
    must(VERB(draw)(desk.scene, &desk.camera, nullptr), VERB(error)(desk.scene));
}

void save(Desk& desk, const std::string& path) {
    std::vector<float> image(4 * static_cast<size_t>(desk.camera.width) * static_cast<size_t>(desk.camera.height));
    must(VERB(read)(desk.scene, image.data()), VERB(error)(desk.scene));
    write_file(path, image.data(), 4 * image.size());
}

/// depth FILE REVERSED OUT: the image behind depths of float32, first row on top.
void behind(Desk& desk, Words& words) {
    const Bytes file = read_file(next(words));
    const int reversed = next<int>(words);
    must(VERB(pose)(desk.scene), VERB(error)(desk.scene));
    must(draw_behind(desk.scene, desk.camera, reinterpret_cast<const float*>(file.data()), reversed), VERB(error)(desk.scene));
    save(desk, next(words));
}

/// composite LINEAR BACKGROUND SAMPLES OUT: a target of bytes of the caller's, which was grey. BACKGROUND "-": none.
void composite(Desk& desk, Words& words) {
    const int linear = next<int>(words);
    const std::string background = next(words);
    const int samples = next<int>(words);
    const float blue[] = {0.25f, 0.5f, 1};
    Bytes read;
    draw(desk);
    must(composite_scene(desk.scene, desk.camera, background == "-" ? nullptr : blue, linear, samples, read), VERB(error)(desk.scene));
    write_file(next(words), read.data(), read.size());
}

/// conform FOLDER NAME: prints a row of each output of a reference.
void conform(Desk& desk, Words& words) {
    const std::string folder = next(words), cases_name = next(words);
    const Bytes mini = read_file(folder + "/mini.avatar"), cases = read_file(folder + "/" + cases_name + ".json");
    const Bytes vectors = read_file(folder + "/" + (cases_name == "cases" ? "vectors" : cases_name) + ".safetensors");
    AvatarPack* pack = avatar_load(mini.data(), mini.size(), "mini.avatar", &desk.allocator);
    AvatarStageRunner runner;
    must(VERB(stage_runner)(desk.scene, &runner), VERB(error)(desk.scene));
    AvatarReport* report = avatar_conform(pack, reinterpret_cast<const char*>(cases.data()), cases.size(), vectors.data(), vectors.size(), &runner,
                                          &desk.allocator);
    if (const char* line = avatar_report_error(report)) {
        const char* own = VERB(error)(desk.scene);
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

/// frames COUNT: as many frames, each of another pose. Prints our allocations, and by how many pages of memory the quarter
/// that grew least grew, the first left out: what is lost each frame is lost in every quarter, a driver's own growth is
/// not.
void frames(Desk& desk, Words& words) {
    const int count = next<int>(words);
    draw(desk);
    const size_t before = desk.counted.calls;
    long pages = 0, least = LONG_MAX;
    for (int i = 0; i <= count; i++) {
        if (i > 0 && i % (count / 4) == 0) {
            finish_screen();
            const long now = resident_pages();
            if (i > count / 4) least = std::min(least, now - pages);
            pages = now;
        }
        if (i == count) break;
        for (const Shown& one : desk.shown) avatar_place(one.instance)[3] = 0.001 * (i % 7);
        draw(desk);
        must(show_scene(desk.scene), VERB(error)(desk.scene));
    }
    std::printf("allocations %zu\npages %ld\n", desk.counted.calls - before, least);
}

/// loads COUNT PACK: loads a pack, draws an instance of it and frees both, so many times; then as `frames`.
void loads(Desk& desk, Words& words) {
    const int count = next<int>(words);
    const Bytes file = read_file(next(words));
    long pages = 0, least = LONG_MAX;
    for (int i = 0; i <= count; i++) {
        if (i > 0 && i % (count / 4) == 0) {
            const long now = resident_pages();
            if (i > count / 4) least = std::min(least, now - pages);
            pages = now;
        }
        AvatarPack* pack = avatar_load(file.data(), file.size(), "a.avatar", &desk.allocator);
        AvatarInstance* instance = avatar_instance_open(pack, 0, &desk.allocator);
        must(VERB(add)(desk.scene, pack, instance), VERB(error)(desk.scene));
        draw(desk);
        must(VERB(remove)(desk.scene, instance), VERB(error)(desk.scene));
        avatar_instance_close(instance);
        avatar_close(pack);
    }
    std::printf("loads %ld\n", least);
}

struct Parts {
    std::vector<std::pair<std::string, double>> ms;
    std::chrono::steady_clock::time_point last;

    static void ended(void* user, const char* stage) {
        Parts* self = static_cast<Parts*>(user);
        const auto now = std::chrono::steady_clock::now();
        const double passed = std::chrono::duration<double, std::milli>(now - self->last).count();
        self->last = now;
        for (auto& [name, sum] : self->ms) {
            if (name == stage) {
                sum += passed;
                return;
            }
        }
        self->ms.emplace_back(stage, passed);
    }
};

/// bench COUNT POSE...: milliseconds a frame, of the CPU and of the wall, each frame with the next of the poses; then as many
/// frames again in their parts.
void bench(Desk& desk, Words& words) {
    const int count = next<int>(words);
    std::vector<Bytes> poses;
    for (std::string path; words >> path;) poses.push_back(read_file(path));
    const auto play = [&](int i) {
        for (const Shown& one : desk.shown) set_pose(one, poses[static_cast<size_t>(i + 3) % poses.size()]);
        draw(desk);
        must(show_scene(desk.scene), VERB(error)(desk.scene));
    };
    for (int i = -3; i < 0; i++) play(i);  // the first ones compile
    finish_screen();
    const double cpu = cpu_seconds();
    const auto wall = std::chrono::steady_clock::now();
    for (int i = 0; i < count; i++) play(i);
    finish_screen();
    const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - wall;
    std::printf("bench %.3f %.3f %s\n", 1000 * (cpu_seconds() - cpu) / count, passed.count() / count, VERB(renderer)(desk.scene));
    Parts parts;
    VERB(set_clock)(desk.scene, &Parts::ended, &parts);
    for (int i = 0; i < count; i++) parts.last = std::chrono::steady_clock::now(), play(i);
    VERB(set_clock)(desk.scene, nullptr, nullptr);
    for (const auto& [name, sum] : parts.ms) std::printf("part %s %.3f\n", name.c_str(), sum / count);
}

/// depth_of MATRICES OUT: the camera of an engine's view and projection, with its depth.
void depth_of(Desk&, Words& words) {
    double matrices[32];
    std::memcpy(matrices, read_file(next(words)).data(), sizeof matrices);
    AvatarCamera camera;
    const char* line = avatar_camera_opengl(&camera, matrices, matrices + 16, 64, 48);
    must(line == nullptr, line);
    line = VERB(camera_depth)(&camera, matrices, matrices + 16);
    must(line == nullptr, line);
    write_file(next(words), &camera, sizeof camera);
}

/// lose [COUNT]: another context or device, and the scene goes on in it; so many times.
void lose(Desk& desk, Words& words) {
    int count = 1;
    words >> count;
    for (int i = 0; i < (words ? count : 1); i++) {
        VERB(forget)(desk.scene);
        close_screen();
        const int refused = VERB(pose)(desk.scene);
        if (i == 0) std::printf("lost %d %s\n", refused, VERB(error)(desk.scene));
        const char* line = open_screen(desk.kind, 256, 256);
        must(line == nullptr, line);
        must(restore_scene(desk.scene), VERB(error)(desk.scene));
    }
}

/// end: closes everything and prints the bytes that are left.
void end(Desk& desk) {
    VERB(close)(desk.scene);
    for (const Shown& one : desk.shown) avatar_instance_close(one.instance);
    for (const auto& [name, pack] : desk.packs) avatar_close(pack);
    close_screen();
    std::printf("left %zu\n", desk.counted.bytes);
    desk.scene = nullptr;
    desk.shown.clear();
    desk.packs.clear();
    alter_screen("");
}

const Shown& shown(Desk& desk, Words& words) { return desk.shown.at(next<size_t>(words)); }

/// light AT FILE: an AvatarLight for an instance; "-": none.
void set_light(Desk& desk, Words& words) {
    const Shown& one = shown(desk, words);
    const std::string path = next(words);
    AvatarLight light = {};
    if (path != "-") std::memcpy(&light, read_file(path).data(), sizeof light);
    must(avatar_set_light(one.instance, path == "-" ? nullptr : &light), avatar_instance_error(one.instance));
}

void set_target(Desk& desk, Words& words) {
    const uint32_t target = next<uint32_t>(words);
    std::printf("target %u %d\n", target, VERB(set_target)(desk.scene, target));
}

void add_again(Desk& desk, Words&) {
    const Shown& one = desk.shown.at(0);
    const int good = VERB(add)(desk.scene, one.pack, one.instance);
    std::printf("twice %d %s\n", good, VERB(error)(desk.scene));
}

/// refused PACK: what cannot be used is refused. The pack is another one than that of the scene.
void refused(Desk& desk, Words& words) {
    const Bytes file = read_file(next(words));
    AvatarPack* other = avatar_load(file.data(), file.size(), "other.avatar", nullptr);
    const Shown& one = desk.shown.at(0);
    refused_arguments(desk.scene, desk.camera, one.pack, one.instance, other);
    avatar_close(other);
}

/// What a job may say, by its first word.
const std::map<std::string, void (*)(Desk&, Words&)> commands = {
    {"begin", &begin},
    {"alter", [](Desk&, Words& words) { alter_screen(next(words)); }},
    {"target", &set_target},
    {"which", [](Desk& desk, Words&) { std::printf("which %u\n", VERB(target)(desk.scene)); }},
    {"add", &add},
    {"twice", &add_again},
    {"pose", [](Desk& desk, Words& words) { const Shown& one = shown(desk, words); set_pose(one, read_file(next(words))); }},
    {"show", [](Desk& desk, Words& words) {
         const Shown& one = shown(desk, words);
         must(VERB(show)(desk.scene, one.instance, next<int>(words)), VERB(error)(desk.scene));
     }},
    {"level", [](Desk& desk, Words& words) {
         const Shown& one = shown(desk, words);
         must(avatar_set_level(one.instance, next<uint32_t>(words)), avatar_instance_error(one.instance));
     }},
    {"light", &set_light},
    {"clear", [](Desk& desk, Words&) { clear(desk); }},
    {"camera", [](Desk& desk, Words& words) { std::memcpy(&desk.camera, read_file(next(words)).data(), sizeof desk.camera); }},
    {"draw", [](Desk& desk, Words& words) { draw(desk), save(desk, next(words)); }},
    {"seen", [](Desk& desk, Words& words) {  // as it was posed for the last image
         must(VERB(draw)(desk.scene, &desk.camera, nullptr), VERB(error)(desk.scene));
         save(desk, next(words));
     }},
    {"depth", &behind},
    {"depth_of", &depth_of},
    {"composite", &composite},
    {"conform", &conform},
    {"frames", &frames},
    {"early", [](Desk& desk, Words&) { refused_early(desk.scene); }},
    {"refused", &refused},
    {"loads", &loads},
    {"bench", &bench},
    {"lose", &lose},
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
