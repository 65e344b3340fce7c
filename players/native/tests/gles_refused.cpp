// What the functions of avatar_gles.h make of NULL, of names and numbers that cannot be used, and of calls in the wrong
// order: each refuses it with a line, and the image stays as it is.
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <limits>

#include "../gles/avatar_gles.h"
#include "gles_refused.h"

namespace {

/// A row: prints what was not refused, or refused without its words.
void row(const char* what, bool good, const char* line, const char* words) {
    const bool named = words == nullptr || (line != nullptr && std::strstr(line, words) != nullptr);
    std::printf("%s %s: %s%s\n", good && named ? "refused" : "taken", what, good ? "" : "was not refused; ", line != nullptr ? line : "no line");
}

void without_scene() {
    AvatarGles* const wrong[] = {nullptr, avatar_gles_open(nullptr, nullptr), avatar_gles_open([](const char*) -> AvatarGlesFunction { return nullptr; }, nullptr)};
    const char* const words[] = {"NULL", "load: is NULL", "a context of OpenGL ES 3.1"};
    for (int i = 0; i < 3; i++) {
        AvatarGles* one = wrong[i];
        float rgba[4];
        AvatarCamera camera = {};
        AvatarStageRunner runner;
        row("avatar_gles_open", avatar_gles_error(one) != nullptr, avatar_gles_error(one), words[i]);
        bool refused = avatar_gles_can_blend(one, 0) == 0 && avatar_gles_set_target(one, 2) == 0 && avatar_gles_add(one, nullptr, nullptr) == 0;
        refused = refused && avatar_gles_remove(one, nullptr) == 0 && avatar_gles_show(one, nullptr, 1) == 0 && avatar_gles_pose(one) == 0;
        refused = refused && avatar_gles_draw(one, &camera, nullptr) == 0 && avatar_gles_composite(one, 0, nullptr, 0) == 0;
        refused = refused && avatar_gles_read(one, rgba) == 0 && avatar_gles_restore(one) == 0 && avatar_gles_stage_runner(one, &runner) == 0;
        avatar_gles_forget(one);
        avatar_gles_set_clock(one, nullptr, nullptr);
        refused = refused && avatar_gles_renderer(one)[0] == 0 && avatar_gles_target(one) == 0;
        row("all functions", refused && avatar_gles_error(one) != nullptr, avatar_gles_error(one), words[i]);
        avatar_gles_close(one);
    }
}

}  // namespace

void refused_early(AvatarGles* gles) {
    const auto line = [&] { return avatar_gles_error(gles); };
    float rgba[4];
    row("avatar_gles_read too early", avatar_gles_read(gles, rgba) == 0, line(), "avatar_gles_draw");
    row("avatar_gles_composite too early", avatar_gles_composite(gles, 0, nullptr, 0) == 0, line(), "avatar_gles_draw");
}

void refused_arguments(AvatarGles* gles, const AvatarCamera& camera, const AvatarPack* pack, AvatarInstance* instance, const AvatarPack* other,
                       uint32_t colour, uint32_t small_depth) {
    without_scene();
    const auto line = [&] { return avatar_gles_error(gles); };
    row("avatar_gles_set_target", avatar_gles_set_target(gles, 3) == 0 && avatar_gles_can_blend(gles, 3) == 0, line(), "cannot blend");
    AvatarInstance* free_one = avatar_instance_open(pack, 0, nullptr);
    row("avatar_gles_add NULL", avatar_gles_add(gles, pack, nullptr) == 0, line(), "no instance");
    row("avatar_gles_add NULL", avatar_gles_add(gles, nullptr, free_one) == 0, line(), "NULL");
    row("avatar_gles_add other", avatar_gles_add(gles, other, free_one) == 0, line(), "of another pack");
    row("avatar_gles_remove", avatar_gles_remove(gles, free_one) == 0 && avatar_gles_remove(gles, nullptr) == 0, line(), "was not added");
    row("avatar_gles_show", avatar_gles_show(gles, free_one, 1) == 0 && avatar_gles_show(gles, nullptr, 1) == 0, line(), "was not added");
    avatar_instance_close(free_one);

    row("avatar_gles_draw NULL", avatar_gles_draw(gles, nullptr, nullptr) == 0, line(), "NULL");
    AvatarCamera bad = camera;
    bad.centre[1] = std::numeric_limits<float>::quiet_NaN();
    row("avatar_gles_draw NaN", avatar_gles_draw(gles, &bad, nullptr) == 0, line(), "not finite");
    bad = camera;
    bad.height = -1;
    row("avatar_gles_draw size", avatar_gles_draw(gles, &bad, nullptr) == 0, line(), "1 to 32768");
    for (const uint32_t texture : {0u, 987654u, colour}) {
        const AvatarGlesDepth depth = {sizeof(AvatarGlesDepth), texture, 0};
        row("avatar_gles_draw depth", avatar_gles_draw(gles, &camera, &depth) == 0, line(), "depth: texture");
    }
    bad = camera;
    bad.struct_size = 0;
    row("avatar_gles_draw struct_size", avatar_gles_draw(gles, &bad, nullptr) == 0, line(), "struct_size");
    const AvatarGlesDepth unsized = {0, small_depth, 0}, depth = {sizeof(AvatarGlesDepth), small_depth, 0};
    row("avatar_gles_draw depth", avatar_gles_draw(gles, &camera, &unsized) == 0, line(), "depth: struct_size");
    row("avatar_gles_draw depth", avatar_gles_draw(gles, &camera, &depth) == 0, line(), "depth: has 3x2 pixels");
    const double x = avatar_place(instance)[3];
    avatar_place(instance)[3] = std::numeric_limits<double>::quiet_NaN();
    row("avatar_gles_draw place", avatar_gles_draw(gles, &camera, nullptr) == 0, line(), "place");
    avatar_place(instance)[3] = x;
    const float weight = avatar_expression_weights(instance)[0];
    avatar_expression_weights(instance)[0] = std::numeric_limits<float>::infinity();
    row("avatar_gles_pose", avatar_gles_pose(gles) == 0, line(), "expression_weights");
    avatar_expression_weights(instance)[0] = weight;

    const float background[3] = {0, std::numeric_limits<float>::quiet_NaN(), 0};
    row("avatar_gles_composite background", avatar_gles_composite(gles, 0, background, 0) == 0, line(), "background");
    row("avatar_gles_composite framebuffer", avatar_gles_composite(gles, 987654, nullptr, 0) == 0, line(), "framebuffer: 987654");
    row("avatar_gles_read NULL", avatar_gles_read(gles, nullptr) == 0, line(), "no memory");
    row("avatar_gles_restore", avatar_gles_restore(gles) == 0, line(), "was not lost");
    AvatarStageRunner runner;
    runner.struct_size = 0;
    row("avatar_gles_stage_runner", avatar_gles_stage_runner(gles, nullptr) == 0, line(), "no runner");
    row("avatar_gles_stage_runner", avatar_gles_stage_runner(gles, &runner) == 0, line(), "struct_size");

    const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    AvatarCamera same = camera;
    row("avatar_gles_camera_depth", avatar_gles_camera_depth(&bad, identity, identity) != nullptr, "", nullptr);
    row("avatar_gles_camera_depth", avatar_gles_camera_depth(&same, identity, identity) != nullptr && avatar_gles_camera_depth(nullptr, identity, identity) != nullptr &&
        avatar_gles_camera_depth(&same, nullptr, identity) != nullptr && std::memcmp(&same, &camera, sizeof camera) == 0, "", nullptr);
}
