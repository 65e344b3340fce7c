// What the functions of a scene make of NULL, of names and numbers that cannot be used, and of calls in the wrong
// order: each refuses it with a line, and the image stays as it is.
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <limits>

#include "desk.h"

void row(const char* what, bool good, const char* line, const char* words) {
    const bool named = words == nullptr || (line != nullptr && std::strstr(line, words) != nullptr);
    std::printf("%s %s: %s%s\n", good && named ? "refused" : "taken", what, good ? "" : "was not refused; ", line != nullptr ? line : "no line");
}

void refused_all(AvatarScene* one, const char* words) {
    float rgba[4];
    AvatarCamera camera = {};
    AvatarStageRunner runner;
    row("open", VERB(error)(one) != nullptr, VERB(error)(one), words);
    bool refused = VERB(can_blend)(one, 0) == 0 && VERB(set_target)(one, 2) == 0 && VERB(add)(one, nullptr, nullptr) == 0;
    refused = refused && VERB(remove)(one, nullptr) == 0 && VERB(show)(one, nullptr, 1) == 0 && VERB(pose)(one) == 0;
    refused = refused && VERB(draw)(one, &camera, nullptr) == 0 && VERB(composite)(one, {}, nullptr, 0) == 0;
    refused = refused && VERB(read)(one, rgba) == 0 && restore_scene(one) == 0 && VERB(stage_runner)(one, &runner) == 0;
    VERB(forget)(one);
    VERB(set_clock)(one, nullptr, nullptr);
    refused = refused && VERB(renderer)(one)[0] == 0 && VERB(target)(one) == 0;
    row("all functions", refused && VERB(error)(one) != nullptr, VERB(error)(one), words);
    VERB(close)(one);
}

void refused_early(AvatarScene* scene) {
    const auto line = [&] { return VERB(error)(scene); };
    float rgba[4];
    row("read too early", VERB(read)(scene, rgba) == 0, line(), "_draw comes first");
    row("composite too early", VERB(composite)(scene, {}, nullptr, 0) == 0, line(), "_draw comes first");
}

void refused_arguments(AvatarScene* scene, const AvatarCamera& camera, const AvatarPack* pack, AvatarInstance* instance, const AvatarPack* other) {
    refused_scenes();
    const auto line = [&] { return VERB(error)(scene); };
    row("set_target", VERB(set_target)(scene, 3) == 0 && VERB(can_blend)(scene, 3) == 0, line(), "cannot blend");
    AvatarInstance* free_one = avatar_instance_open(pack, 0, nullptr);
    row("add NULL", VERB(add)(scene, pack, nullptr) == 0, line(), "no instance");
    row("add NULL", VERB(add)(scene, nullptr, free_one) == 0, line(), "NULL");
    row("add other", VERB(add)(scene, other, free_one) == 0, line(), "of another pack");
    row("remove", VERB(remove)(scene, free_one) == 0 && VERB(remove)(scene, nullptr) == 0, line(), "was not added");
    row("show", VERB(show)(scene, free_one, 1) == 0 && VERB(show)(scene, nullptr, 1) == 0, line(), "was not added");
    avatar_instance_close(free_one);

    row("draw NULL", VERB(draw)(scene, nullptr, nullptr) == 0, line(), "NULL");
    AvatarCamera bad = camera;
    bad.centre[1] = std::numeric_limits<float>::quiet_NaN();
    row("draw NaN", VERB(draw)(scene, &bad, nullptr) == 0, line(), "not finite");
    bad = camera;
    bad.height = -1;
    row("draw size", VERB(draw)(scene, &bad, nullptr) == 0, line(), "1 to 32768");
    bad = camera;
    bad.struct_size = 0;
    row("draw struct_size", VERB(draw)(scene, &bad, nullptr) == 0, line(), "struct_size");
    refused_views(scene, camera);
    const double x = avatar_place(instance)[3];
    avatar_place(instance)[3] = std::numeric_limits<double>::quiet_NaN();
    row("draw place", VERB(draw)(scene, &camera, nullptr) == 0, line(), "place");
    avatar_place(instance)[3] = x;
    const float weight = avatar_expression_weights(instance)[0];
    avatar_expression_weights(instance)[0] = std::numeric_limits<float>::infinity();
    row("pose", VERB(pose)(scene) == 0, line(), "expression_weights");
    avatar_expression_weights(instance)[0] = weight;

    const float background[3] = {0, std::numeric_limits<float>::quiet_NaN(), 0};
    row("composite background", VERB(composite)(scene, {}, background, 0) == 0, line(), "background");
    row("read NULL", VERB(read)(scene, nullptr) == 0, line(), "no memory");
    row("restore", restore_scene(scene) == 0, line(), "was not lost");
    AvatarStageRunner runner;
    runner.struct_size = 0;
    row("stage_runner", VERB(stage_runner)(scene, nullptr) == 0, line(), "no runner");
    row("stage_runner", VERB(stage_runner)(scene, &runner) == 0, line(), "struct_size");

    const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    AvatarCamera same = camera;
    row("camera_depth", VERB(camera_depth)(&bad, identity, identity) != nullptr, "", nullptr);
    row("camera_depth", VERB(camera_depth)(&same, identity, identity) != nullptr && VERB(camera_depth)(nullptr, identity, identity) != nullptr &&
        VERB(camera_depth)(&same, nullptr, identity) != nullptr && std::memcmp(&same, &camera, sizeof camera) == 0, "", nullptr);
}
