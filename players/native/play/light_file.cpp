#include "light_file.h"

#include "../src/formats/json.h"
#include "../src/made/constants.h"

using namespace avatar;

static void read_ambient(Json said, AvatarLight& into) {
    const JsonList rows = said.list();
    if (rows.size == 3) {
        double colour[3] = {};
        said.vector(colour);
        for (int i = 0; i < 3; i++) into.ambient[0][i] = colour[i] / sh_c0[0];
    } else if (rows.size == 9) {
        for (uint32_t k = 0; k < 9; k++) rows[k].vector(into.ambient[k]);
    } else {
        said.set("is neither a colour nor nine rows of one");
    }
}

static void read_direct(Json said, AvatarDirectLight& into) {
    const Json position = said.at("position"), direction = said.at("direction");
    if (position.given() == direction.given()) said.set("needs a direction or a position, and a colour");
    into.point = position.given();
    (into.point != 0 ? position : direction).vector(into.place);
    said.at("colour").vector(into.colour);
}

static void read_whole(Json said, AvatarLight& into) {
    static const char* const known[] = {"ambient", "lights", "shadow", "frame", "name"};
    for (Json one : said.entries()) {
        bool found = false;
        for (const char* name : known) found |= one.key() == name;
        if (!found) one.set("is not known; a light has ambient, lights and shadow");
    }
    const Json ambient = said.at("ambient"), lights = said.at("lights"), shadow = said.at("shadow");
    if (ambient.given()) read_ambient(ambient, into);
    if (shadow.given()) into.shadow = shadow.flag();
    if (!lights.given() || said.errors().any()) return;
    for (Json one : lights.list(0, AVATAR_MOST_LIGHTS)) {
        if (!said.errors().any()) read_direct(one, into.lights[into.count++]);
    }
}

std::string read_light(const std::string& text, const std::string& name, AvatarLight& into) {
    Errors errors;
    errors.set_owner(name.c_str());
    Arena arena(allocator_or_default(nullptr), errors);
    JsonTree tree(arena, "$");
    if (!tree.parse(Text(text.data(), text.size()))) errors.set("", "is not JSON: %s", tree.why);
    else read_whole(Json(tree, errors), into);
    return errors.any() ? errors.line() : "";
}
