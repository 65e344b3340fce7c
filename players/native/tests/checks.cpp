// Checks that need the parts of the library: programs that were changed, memory that runs out.
#include "checks.h"

#include <cstring>
#include <limits>

#include "../src/pack/read.h"

using namespace avatar;

namespace {

/// Programs as JSON: sections, buffers and passes that several programs share are written once.
class ProgramCases {
public:
    ProgramCases(Json cases, Arena& arena) : arena_(arena) {
        const JsonList sections = cases.at("sections").list(), buffers = cases.at("buffers").list(), passes = cases.at("passes").list();
        sections_ = arena.make<Section>(sections.size);
        size_t at = 0;
        for (Json one : sections) sections_[at++] = section(one.list(3, 3));
        buffers_ = arena.make<Buffer>(buffers.size);
        at = 0;
        for (Json one : buffers) buffers_[at++] = buffer(one.list(3, 3));
        passes_ = arena.make<Pass>(passes.size);
        at = 0;
        for (Json one : passes) passes_[at++] = pass(one);
    }

    /// A program, with own memory for what a check writes.
    void read(Json said, Program& program, Arena& arena) const {
        const JsonList buffers = said.at("buffers").list();
        program.buffers = arena.make<Buffer>(buffers.size);
        program.buffer_names.make(arena, buffers.size);
        uint32_t at = 0;
        for (Json one : buffers) {
            const JsonList pair = one.list(2, 2);
            program.buffers[at] = buffers_[static_cast<size_t>(pair[1].integer())];
            program.buffer_names.add(pair[0].text(), at++);
        }
        program.mesh = passes(said.at("mesh"), arena);
        const JsonList levels = said.at("levels").list();
        program.levels = arena.make<Level>(levels.size);
        at = 0;
        for (Json one : levels) program.levels[at++] = level(one, arena);
        const Json pose = said.at("pose");
        program.pose = {clamped(pose.at("weights")), clamped(pose.at("features")), clamped(pose.at("late")), clamped(pose.at("joints"))};
        program.pose_floats = clamped(said.at("poseFloats"));
        program.reads_mesh = said.at("readsMesh").flag();
    }

private:
    static int32_t clamped(Json said) {
        const double number = said.number();
        return number < INT32_MIN ? INT32_MIN : number > INT32_MAX ? INT32_MAX : static_cast<int32_t>(number);
    }

    static int digit(char letter) {
        static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        const char* found = std::strchr(letters, letter);
        return found == nullptr || letter == 0 ? -1 : static_cast<int>(found - letters);
    }

    Section section(JsonList said) const {
        const Text text = said[2].text();
        Span<uint8_t> bytes = arena_.make<uint8_t>(text.size);
        size_t count = 0;
        uint32_t held = 0, bits = 0;
        for (uint32_t i = 0; i < text.size && digit(text.data[i]) >= 0; i++) {
            held = held << 6 | static_cast<uint32_t>(digit(text.data[i]));
            bits += 6;
            if (bits < 8) continue;
            bits -= 8;
            bytes[count++] = static_cast<uint8_t>(held >> bits);
        }
        Section made = {said[0].text(), {}};
        made.elements.data = bytes.data;
        made.elements.bits = static_cast<uint32_t>(said[1].integer());
        made.elements.length = static_cast<uint32_t>(count / (made.elements.bits / 8));
        return made;
    }

    Buffer buffer(JsonList said) const {
        const JsonList listed = said[2].list();
        Buffer made = {said[0].text(), said[1].number(), arena_.make<Section>(listed.size)};
        size_t at = 0;
        for (Json one : listed) made.sections[at++] = sections_[static_cast<size_t>(one.integer())];
        return made;
    }

    Pass pass(Json said) const {
        const JsonList buffers = said.at("buffers").entries(), constants = said.at("constants").entries();
        Pass made = {said.at("entry").text(), said.at("rows").number(), arena_.make<Bound>(buffers.size), arena_.make<Constant>(constants.size)};
        size_t at = 0;
        for (Json one : buffers) made.buffers[at++] = {one.key(), one.text(), 0};
        at = 0;
        for (Json one : constants) {
            Constant& constant = made.constants[at++];
            constant = {};
            constant.name = one.key();
            if (one.is(JsonKind::list)) {
                constant.kind = Constant::Kind::vector;
                for (Json value : one.list(0, 4)) constant.vector[constant.floats++] = value.number();
            } else if (!one.is(JsonKind::text)) {
                constant.number = one.number();
                if (arena_.errors().any()) constant.number = std::numeric_limits<double>::infinity();  // true
                arena_.errors().clear();
            } else if (one.text() == "NaN") {
                constant.number = std::numeric_limits<double>::quiet_NaN();
            } else if (one.text() == "Infinity") {
                constant.number = std::numeric_limits<double>::infinity();
            } else {
                constant.kind = Constant::Kind::source;
                constant.source = one.text();
            }
        }
        return made;
    }

    Span<Pass> passes(Json said, Arena& arena) const {
        const JsonList listed = said.list();
        Span<Pass> made = arena.make<Pass>(listed.size);
        size_t at = 0;
        for (Json one : listed) {
            made[at] = passes_[static_cast<size_t>(one.integer())];
            made[at].buffers = arena.copy(made[at].buffers.data, made[at].buffers.size);
            at++;
        }
        return made;
    }

    Level level(Json said, Arena& arena) const {
        const JsonList chunks = said.at("chunks").list();
        Level made = {said.at("prefix").text(), arena.make<Run>(chunks.size), passes(said.at("deform"), arena), passes(said.at("view"), arena),
                      passes(said.at("shadow"), arena), passes(said.at("light"), arena)};
        size_t at = 0;
        for (Json one : chunks) made.chunks[at++] = {clamped(one.at("first")), clamped(one.at("count"))};
        return made;
    }

    Arena& arena_;
    Span<Section> sections_;
    Span<Buffer> buffers_;
    Span<Pass> passes_;
};

/// Loads, drives and makes passes. Returns whether nothing failed.
bool play(const std::vector<uint8_t>& file, const AvatarAllocator& allocator, Counter& counter, size_t frames, size_t* during) {
    AvatarPack* pack = avatar_load(file.data(), file.size(), "a.avatar", &allocator);
    AvatarInstance* instance = avatar_instance_open(pack, 0, &allocator);
    AvatarPasses* passes = avatar_passes_open(pack, 0, AVATAR_DEFORM, &allocator);
    const AvatarSceneChunk chunk = {sizeof(AvatarSceneChunk), "0/Projected.0", 1000};
    AvatarSort* sort = avatar_sort_open(&chunk, 1, &allocator);
    bool sound = avatar_error(pack) == nullptr && avatar_instance_error(instance) == nullptr &&
                 avatar_passes_error(passes) == nullptr && avatar_sort_error(sort) == nullptr;
    sound = sound && avatar_enable_driving(instance, 0) == AVATAR_OK && avatar_enable_driving(instance, 1) == AVATAR_OK;
    const size_t before = counter.calls;
    for (size_t i = 0; i < frames && sound; i++) {
        AvatarFrame frame = {};
        frame.weights[i % 52] = 0.5f;
        frame.head[0] = 1e-4 * static_cast<double>(i);
        avatar_enable_driving(instance, i % 2 == 0);
        avatar_drive(instance, &frame);
        avatar_clip_pose(instance, 0, 1e-3 * static_cast<double>(i));
        avatar_set_expression(instance, "jawOpen", 0.3);
        AvatarCamera camera;
        const double target[3] = {0, 0, 0};
        avatar_camera_orbit(&camera, target, 1, 1e-3 * static_cast<double>(i), 0, 0.8, 64, 64);
        avatar_update_pose(instance);
        avatar_update_camera(instance, &camera);
        avatar_passes_set(passes, instance);
    }
    *during += counter.calls - before;
    avatar_sort_close(sort);
    avatar_passes_close(passes);
    avatar_instance_close(instance);
    avatar_close(pack);
    return sound;
}

}  // namespace

int programs(const std::string& folder, Records& out) {
    const std::vector<uint8_t> text = read_file(folder + "/programs.json");
    Errors errors;
    Arena arena(allocator_or_default(nullptr), errors);
    JsonTree tree(arena, "$");
    if (!tree.parse(Text(reinterpret_cast<const char*>(text.data()), text.size()))) {
        std::fprintf(stderr, "%s\n", tree.why);
        return 1;
    }
    const ProgramCases cases(Json(tree, errors), arena);
    size_t index = 0;
    for (Json said : Json(tree, errors).at("programs").list()) {
        Errors own;
        Arena scratch(allocator_or_default(nullptr), own);
        Program program = {};
        cases.read(said, program, scratch);
        check_program(program, static_cast<uint32_t>(said.at("groups").integer()), scratch);
        out.text(std::to_string(index) + "/field", own.any() ? own.field() : nullptr);
        out.text(std::to_string(index++) + "/reason", own.any() ? own.reason() : nullptr);
    }
    if (errors.any()) std::fprintf(stderr, "%s\n", errors.line());
    return errors.any() ? 1 : 0;
}

int memory(const std::string& folder, Records& out) {
    const std::vector<uint8_t> file = read_file(folder + "/pack.avatar");
    Counter counter;
    const AvatarAllocator allocator = counter.allocator();
    size_t during = 0;
    bool sound = true;
    for (int i = 0; i < 50; i++) sound = sound && play(file, allocator, counter, 1, &during);
    const size_t poses = file.size() < 20000 ? 10000 : 500;  // of the larger pack fewer
    sound = sound && play(file, allocator, counter, poses, &during);
    const uint64_t kept[] = {sound, counter.blocks, counter.bytes, during, counter.calls};
    out.add("counted", kept, sizeof(kept));
    size_t wrong = 0, tried = 0;
    for (bool done = false; !done; tried += poses == 500 ? 3 : 1) {  // every allocation fails once
        Counter failing;
        failing.fails_at = tried;
        done = play(file, failing.allocator(), failing, 1, &during);
        wrong += failing.blocks != 0 || (done && failing.calls > tried);
    }
    const uint64_t failed[] = {tried, wrong};
    out.add("failing", failed, sizeof(failed));
    return 0;
}

int inflated(const std::string& folder, Records& out) {
    size_t count = 0;
    for (const Bytes& file : read_files(folder + "/files.bin")) {
        Errors errors;
        Gzip gzip(file.data(), file.size(), allocator_or_default(nullptr), errors);
        for (size_t wanted = 1; gzip.inflate(wanted); wanted = gzip.length() + 1 + gzip.length() / 3) {}  // in pieces
        if (gzip.wrong == nullptr) gzip.check_end();
        out.text(std::to_string(count) + "/wrong", gzip.wrong);
        out.add(std::to_string(count++) + "/bytes", gzip.bytes(), gzip.length());
    }
    return 0;
}
