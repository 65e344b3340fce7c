// What a document says of an avatar without arrays: names, rules, driving, levels, framing.
#include <cmath>
#include <cstdio>

#include "read.h"

namespace avatar {

static constexpr double frame_margin = 1.08;  // of a frame about a box

Span<Expression> read_expressions(Json avatar, Arena& arena, Arena& scratch) {
    const Json listed = avatar.at("expressions");
    const JsonList said = listed.list();
    Span<Expression> found = arena.make<Expression>(said.size);
    Names names;
    if (!names.make(scratch, said.size) || found.size < said.size) return {};
    uint32_t i = 0;
    bool twice = false;
    for (Json one : said) {
        Expression& made = found[i];
        const JsonList range = one.at("range").list(2, 2);
        if (arena.errors().any()) return {};
        made.low = range[0].number();
        made.high = range[1].number();
        const Json aliases = one.at("aliases");
        if (aliases.given()) made.aliases = aliases.texts(arena);
        made.name = arena.copy(one.at("name").text());
        if (arena.errors().any()) return {};
        twice |= !names.add(made.name, i++);
    }
    if (twice) listed.set("has a name twice");
    return found;
}

/// The name of a joint; empty where there is none.
static Text optional_name(Json said, const char* name, Arena& arena) {
    const Json member = said.at(name);
    if (!member.given()) return {};
    if (member.text().size == 0) member.fail("a name is needed");
    return arena.copy(member.text());
}

Rules read_rules(Json avatar, Arena& arena) {
    const Json rules = avatar.at("rules");
    return {arena.copy(rules.at("rotation").text()), optional_name(rules, "rotation_joint", arena), arena.copy(rules.at("anchor").text())};
}

static Group read_group(Json said, Arena& arena) {
    static const char* const bindings[] = {"skin", "anchor", "joint_mix", "surface", "none"};
    Group made = {};
    const Json mix = said.at("joint_mix");
    if (mix.given()) {
        const JsonList factors = mix.entries();
        made.joint_mix = arena.make<Factor>(factors.size);
        size_t at = 0;
        for (Json one : factors) {
            if (arena.errors().any()) return made;
            made.joint_mix[at++] = Factor{arena.copy(one.key()), one.number()};
        }
    }
    made.name = arena.copy(said.at("name").text());
    made.first = said.at("first").integer();
    made.count = said.at("count").integer();
    const Text binding = said.at("binding").text();
    for (uint8_t i = 0; i < 5; i++) {
        if (binding == bindings[i]) made.binding = static_cast<Binding>(i);
    }
    return made;
}

Span<Group> read_groups(Json level, Arena& arena) {
    Errors& errors = arena.errors();
    const int32_t count = level.at("count").integer();
    const Json listed = level.at("groups");
    const JsonList said = listed.list();
    Span<Group> groups = arena.make<Group>(said.size);
    int64_t next = 0;
    size_t at = 0;
    for (Json one : said) {
        if (errors.any()) return {};
        const Group group = read_group(one, arena);
        if (group.first != next) {
            char line[120];
            std::snprintf(line, sizeof(line), "covers %d+%d, but row %lld comes next", group.first, group.count,
                          static_cast<long long>(next));
            one.set(line);
        }
        next += group.count;
        groups[at++] = group;
    }
    if (next != count) {
        char line[80];
        std::snprintf(line, sizeof(line), "cover %lld of %d Gaussians", static_cast<long long>(next), count);
        listed.set(line);
    }
    return groups;
}

bool read_driving(Json document, Arena& arena, Driving& into) {
    const Json avatar = document.at("avatar").at("driving");
    const Text mode = avatar.at("mode").text();
    // The manifest's own matrix is in the frame of the pack; `driving` of the document spells out mode "names".
    const Json linear = mode == "matrix" ? avatar : document.at("driving");
    if (mode == "none" || linear.is_missing() || arena.errors().any()) return false;
    into.inputs = linear.at("inputs").texts(arena);
    into.outputs = linear.at("outputs").texts(arena);
    const uint32_t rows = static_cast<uint32_t>(into.outputs.size), columns = static_cast<uint32_t>(into.inputs.size);
    const JsonList matrix = linear.at("matrix").list(rows, rows);
    if (arena.errors().any()) return false;
    into.matrix = arena.make<double>(static_cast<size_t>(rows) * columns);
    size_t at = 0;
    for (Json row : matrix) {
        if (arena.errors().any()) return false;
        for (Json value : row.list(columns, columns)) {
            into.matrix[at++] = static_cast<double>(static_cast<float>(value.number()));
        }
    }
    into.head_joint = optional_name(avatar, "head_joint", arena);
    const Json pivot = avatar.at("head_pivot");
    if (pivot.given()) pivot.vector(into.head_pivot);
    into.left_eye_joint = optional_name(avatar, "left_eye_joint", arena);
    into.right_eye_joint = optional_name(avatar, "right_eye_joint", arena);
    return !arena.errors().any();
}

static double psnr_in_mask(Json error) {
    if (!error.given()) return -1;
    const Json psnr = error.at("psnr_mask_db");
    if (!psnr.given()) return -1;
    const Json mean = psnr.at("mean");
    return mean.given() ? mean.number() : -1;
}

Span<LevelInfo> read_levels(Json document, Arena& arena) {
    const JsonList said = document.at("levels").list();
    Span<LevelInfo> found = arena.make<LevelInfo>(said.size);
    size_t at = 0;
    for (Json one : said) {
        if (arena.errors().any()) return {};
        const Json height = one.at("height_px");
        found[at].count = one.at("count").integer();
        found[at].height_px = height.given() ? height.number() : -1;
        found[at].psnr_db = psnr_in_mask((at == 0 ? document : one).at("error"));
        at++;
    }
    return found;
}

static void read_box(Json said, double* low, double* high) {
    said.at("min").vector(low);
    said.at("max").vector(high);
}

void read_bounds(Json avatar, bool left, double* low, double* high) {
    read_box(avatar.at("bounds").at("swept"), low, high);
    if (!left) return;
    const double lowest = low[0];
    low[0] = -high[0];
    high[0] = -lowest;
}

/// A vector [3] of a pack, right-handed.
static void read_vector(Json said, bool left, double* into) {
    said.vector(into);
    if (left) into[0] = -into[0];
}

static FramedPart read_part(Json said, bool left) {
    FramedPart part = {};
    part.given = said.given();
    if (!part.given) return part;
    read_vector(said.at("target"), left, part.target);
    said.at("size").vector(part.size);
    return part;
}

/// Without a stated frame, the box at rest.
static FramedPart around_rest(Json avatar, bool left) {
    double low[3], high[3];
    read_box(avatar.at("bounds").at("rest"), low, high);
    FramedPart part = {};
    part.given = true;
    for (int i = 0; i < 3; i++) {
        part.target[i] = (low[i] + high[i]) / 2;
        part.size[i] = (high[i] - low[i]) * frame_margin;
    }
    if (left) part.target[0] = -part.target[0];
    return part;
}

Framing read_framing(Json document, bool left) {
    Framing framing = {};
    framing.up[1] = framing.front[2] = 1;
    const Json said = document.at("framing");
    if (said.given()) {
        read_vector(said.at("up"), left, framing.up);
        read_vector(said.at("front"), left, framing.front);
        framing.whole = read_part(said.at("whole"), left);
        framing.head = read_part(said.at("head"), left);
    }
    if (!framing.whole.given) framing.whole = around_rest(document.at("avatar"), left);
    return framing;
}

bool read_background(Json avatar, double* into) {
    const Json said = avatar.at("background");
    if (said.is(JsonKind::text)) return false;
    said.vector(into);
    return true;
}

}  // namespace avatar
