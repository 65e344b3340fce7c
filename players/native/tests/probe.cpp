// Prints what the library makes of packs, poses, recordings and packets, for a judge that shares no code with it.
//   probe COMMAND FOLDER OUT: reads what it needs from FOLDER, writes records to OUT.
#include <cstring>

#include "avatar_player.h"
#include "../fuzz/use_everything.h"
#include "checks.h"

namespace {

struct Loaded {
    std::vector<uint8_t> file;
    AvatarPack* pack;
    AvatarFacts facts = {};

    explicit Loaded(const std::string& path) : file(read_file(path)), pack(avatar_load(file.data(), file.size(), "a.avatar", nullptr)) {
        avatar_facts(pack, &facts);
        if (avatar_error(pack) != nullptr) std::fprintf(stderr, "%s: %s\n", path.c_str(), avatar_error(pack));
    }
    ~Loaded() { avatar_close(pack); }
};

std::string number(size_t i) { return std::to_string(i); }

/// Everything that a pack holds.
int contents(const std::string& folder, Records& out) {
    const Loaded of(folder + "/pack.avatar");
    const AvatarFacts& a = of.facts;
    out.text("error", avatar_error(of.pack));
    out.text("name", a.name);
    out.add("target", a.whole_target, 24);
    out.add("low", a.bounds_low, 24);
    out.add("high", a.bounds_high, 24);
    for (uint32_t i = 0; i < a.buffers; i++) {
        AvatarBuffer buffer;
        avatar_buffer(of.pack, i, &buffer);
        std::vector<uint8_t> bytes(buffer.bytes);
        if (buffer.has_content) avatar_buffer_content(of.pack, i, bytes.data());
        out.add(std::string("size/") + buffer.name, &buffer.bytes, 4);
        out.add(std::string("buffer/") + buffer.name, bytes.data(), buffer.has_content ? bytes.size() : 0);
    }
    for (uint32_t i = 0; i < a.clips; i++) {
        AvatarClip clip;
        avatar_clip(of.pack, i, &clip);
        const std::string at = "clip/" + number(i) + "/";
        out.text(at + "name", clip.name);
        out.add(at + "expressionWeights", clip.expression_weights, 4 * size_t{clip.frames} * a.expressions);
        out.add(at + "lateWeights", clip.eyelid_weights, 4 * size_t{clip.frames} * a.eyelids);
        out.add(at + "jointDelta", clip.joint_delta, 64 * size_t{clip.frames} * a.joints);
        out.add(at + "worldFromAvatar", clip.world_from_avatar, 64 * size_t{clip.frames});
    }
    for (uint32_t i = 0; i < a.expressions; i++) {
        double range[2];
        avatar_expression_range(of.pack, i, &range[0], &range[1]);
        const std::string name = avatar_expression_name(of.pack, i);
        out.add("expression/" + name, range, sizeof(range));
        for (uint32_t k = 0; const char* alias = avatar_expression_alias(of.pack, i, k); k++) {
            const int32_t meant = avatar_expression_index(of.pack, alias);
            out.add("alias/" + name + "/" + alias, &meant, sizeof(meant));
        }
    }
    for (uint32_t i = 0; i < a.groups; i++) {
        AvatarGroup group;
        avatar_group(of.pack, i, &group);
        const std::string line = std::string(group.name) + " " + number(group.first) + " " + number(group.count) + " " + group.binding;
        out.text("group/" + number(i), line.c_str());
    }
    for (uint32_t i = 0; i < a.joints; i++) out.text("joint/" + number(i), avatar_joint_name(of.pack, i));
    if (a.joints > 0) {
        out.add("parents", avatar_joint_parents(of.pack), 4 * size_t{a.joints});
        out.add("restLocal", avatar_rest_local(of.pack), 128 * size_t{a.joints});
        out.add("inverseBindMatrix", avatar_inverse_bind(of.pack), 128 * size_t{a.joints});
    }
    return 0;
}

/// Poses of a file: for each its weights, late weights, deltas and world matrix, float64.
int poses(const std::string& folder, Records& out) {
    const Loaded of(folder + "/pack.avatar");
    const std::vector<double> given = read_numbers<double>(folder + "/poses.f64");
    AvatarInstance* instance = avatar_instance_open(of.pack, 0, nullptr);
    out.text("error", avatar_instance_error(instance));
    const AvatarFacts& a = of.facts;
    const size_t k = a.expressions, l = a.eyelids, j = 16 * size_t{a.joints}, row = k + l + j + 16;
    std::vector<float> floats, matrix, rotation;
    for (size_t at = 0; at + row <= given.size(); at += row) {
        const double* from = given.data() + at;
        for (size_t i = 0; i < k; i++) avatar_expression_weights(instance)[i] = static_cast<float>(from[i]);
        for (size_t i = 0; i < l; i++) avatar_eyelid_weights(instance)[i] = static_cast<float>(from[k + i]);
        if (j > 0) std::memcpy(avatar_joint_delta(instance), from + k + l, j * 8);
        std::memcpy(avatar_world_from_avatar(instance), from + k + l + j, 128);
        avatar_update_pose(instance);
        uint32_t count = 0;
        const float* made = avatar_pose_floats(instance, &count);
        floats.insert(floats.end(), made, made + count);
        made = avatar_group_matrix(instance);
        matrix.insert(matrix.end(), made, made + 12 * a.groups);
        made = avatar_group_rotation(instance);
        rotation.insert(rotation.end(), made, made + 12 * a.groups);
    }
    out.add("pose_floats", floats.data(), 4 * floats.size());
    out.add("group_matrix", matrix.data(), 4 * matrix.size());
    out.add("group_rotation", rotation.data(), 4 * rotation.size());
    avatar_instance_close(instance);
    return 0;
}

/// Clip 0 at times: weights, late weights, deltas and world matrix of each, float64.
int clips(const std::string& folder, Records& out) {
    const Loaded of(folder + "/pack.avatar");
    AvatarInstance* instance = avatar_instance_open(of.pack, 0, nullptr);
    const AvatarFacts& a = of.facts;
    std::vector<double> made;
    for (const double seconds : read_numbers<double>(folder + "/times.f64")) {
        if (avatar_clip_pose(instance, 0, seconds) != AVATAR_OK) return 1;
        for (size_t i = 0; i < a.expressions; i++) made.push_back(static_cast<double>(avatar_expression_weights(instance)[i]));
        for (size_t i = 0; i < a.eyelids; i++) made.push_back(static_cast<double>(avatar_eyelid_weights(instance)[i]));
        made.insert(made.end(), avatar_joint_delta(instance), avatar_joint_delta(instance) + 16 * a.joints);
        made.insert(made.end(), avatar_world_from_avatar(instance), avatar_world_from_avatar(instance) + 16);
    }
    out.add("sampled", made.data(), 8 * made.size());
    avatar_clip_pose(instance, 99, 0);
    out.text("no clip", avatar_instance_error(instance));
    avatar_instance_close(instance);
    return 0;
}

/// Stages driving and joints of the folder's reference.
int conform_cpu(const std::string& folder, Records& out) {
    const Loaded of(folder + "/pack.avatar");
    const std::vector<uint8_t> cases = read_file(folder + "/driving.json"), vectors = read_file(folder + "/driving.safetensors");
    AvatarReport* report = avatar_conform(of.pack, reinterpret_cast<const char*>(cases.data()), cases.size(), vectors.data(),
                                          vectors.size(), nullptr, nullptr);
    out.text("error", avatar_report_error(report));
    const uint8_t passed = avatar_report_passed(report) != 0;
    out.add("passed", &passed, 1);
    AvatarReportRow row;
    for (uint32_t i = 0; avatar_report_row(report, i, &row) == AVATAR_OK; i++) {
        const double used[] = {row.used, static_cast<double>(row.passed)};
        out.add(std::string(row.name) + "/" + row.stage + "/" + row.output, used, sizeof(used));
    }
    avatar_report_close(report);
    return 0;
}

/// Cameras: orbit rows of 9 numbers, opencv rows of 23, opengl rows of 34, all by arguments.
int cameras(const std::string& folder, Records& out) {
    std::vector<AvatarCamera> made;
    const std::vector<double> orbit = read_numbers<double>(folder + "/orbit.f64"), opencv = read_numbers<double>(folder + "/opencv.f64");
    const std::vector<double> opengl = read_numbers<double>(folder + "/opengl.f64");
    for (size_t at = 0; at + 9 <= orbit.size(); at += 9) {
        const double* g = &orbit[at];
        AvatarCamera camera;
        avatar_camera_orbit(&camera, g, g[3], g[4], g[5], g[6], static_cast<int32_t>(g[7]), static_cast<int32_t>(g[8]));
        made.push_back(camera);
    }
    for (size_t at = 0; at + 23 <= opencv.size(); at += 23) {
        const double* g = &opencv[at];
        AvatarCamera camera;
        avatar_camera_opencv(&camera, g, g + 9, g + 12, static_cast<int32_t>(g[21]), static_cast<int32_t>(g[22]));
        made.push_back(camera);
    }
    for (size_t at = 0; at + 34 <= opengl.size(); at += 34) {
        const double* g = &opengl[at];
        AvatarCamera camera;
        avatar_camera_opengl(&camera, g, g + 16, static_cast<int32_t>(g[32]), static_cast<int32_t>(g[33]));
        made.push_back(camera);
    }
    out.add("cameras", made.data(), made.size() * sizeof(AvatarCamera));
    return 0;
}

/// The channels of recording.csv at times, its facts, and the frames of packets.bin.
int recordings(const std::string& folder, Records& out) {
    const std::vector<uint8_t> csv = read_file(folder + "/recording.csv");
    AvatarRecording* recording = avatar_recording_open(reinterpret_cast<const char*>(csv.data()), csv.size(), "take.csv", nullptr);
    out.text("error", avatar_recording_error(recording));
    AvatarRecordingFacts facts;
    avatar_recording_facts(recording, &facts);
    out.add("times", facts.times, 8 * size_t{facts.frames});
    out.add("channels", facts.channels, 8 * 61 * size_t{facts.frames});
    out.add("fps", &facts.fps, 8);
    std::vector<AvatarFrame> frames;
    for (const double seconds : read_numbers<double>(folder + "/take_times.f64")) {
        AvatarFrame frame;
        avatar_recording_sample(recording, seconds, &frame);
        frames.push_back(frame);
    }
    out.add("frames", frames.data(), frames.size() * sizeof(AvatarFrame));
    avatar_recording_close(recording);
    const std::vector<uint8_t> packets = read_file(folder + "/packets.bin");
    std::vector<uint8_t> taken;
    std::vector<AvatarFrame> faces;
    for (size_t at = 0; at < packets.size();) {
        uint32_t length;
        std::memcpy(&length, &packets[at], 4);
        const std::vector<uint8_t> own(packets.begin() + static_cast<ptrdiff_t>(at + 4), packets.begin() + static_cast<ptrdiff_t>(at + 4 + length));
        AvatarFrame frame = {};
        taken.push_back(avatar_read_packet(own.data(), own.size(), &frame) != 0);
        faces.push_back(frame);
        at += 4 + length;
        at += packets[at] != 0 ? 1 + 8 * 61 : 1;
    }
    out.add("taken", taken.data(), taken.size());
    out.add("faces", faces.data(), faces.size() * sizeof(AvatarFrame));
    return 0;
}

/// A line for each file of a stream, each after its length: what is wrong, or nothing.
int refusals(const std::string& folder, Records& out) {
    size_t count = 0;
    for (const Bytes& file : read_files(folder + "/files.bin")) {
        AvatarPack* pack = avatar_load(file.data(), file.size(), "a.avatar", nullptr);
        out.text(number(count++), avatar_error(pack));
        if (avatar_error(pack) == nullptr) use_everything(pack, nullptr);
        avatar_close(pack);
    }
    return 0;
}

/// Spellings of channels, a name a line.
int spellings(const std::string& folder, Records& out) {
    const std::vector<uint8_t> names = read_file(folder + "/names.txt");
    std::string line;
    for (const uint8_t letter : names) {
        if (letter != '\n') {
            line += static_cast<char>(letter);
            continue;
        }
        const int32_t channel = avatar_arkit_channel(line.c_str());
        out.text(line, channel < 0 ? "" : avatar_arkit_name(static_cast<uint32_t>(channel)));
        line.clear();
    }
    return 0;
}

}  // namespace

int main(int count, char** words) {
    const struct {
        const char* name;
        int (*run)(const std::string&, Records&);
    } commands[] = {{"contents", contents},     {"poses", poses},       {"clips", clips},       {"conform", conform_cpu},
                    {"cameras", cameras},   {"recordings", recordings},
                    {"refusals", refusals},     {"spellings", spellings}, {"programs", programs}, {"memory", memory}, {"inflated", inflated}, {"refused", refused}};
    int failed = count % 3 == 1 && count > 1 ? 0 : 2;
    for (int at = 1; at + 2 < count && failed == 0; at += 3) {
        Records out(words[at + 2]);
        failed = out.sound() ? 3 : 4;
        for (const auto& one : commands) {
            if (std::strcmp(one.name, words[at]) == 0) failed = one.run(words[at + 1], out);
        }
    }
    return failed;
}
