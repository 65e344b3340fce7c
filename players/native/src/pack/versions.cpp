// Which packs this player reads.
#include <cstdio>

#include "../made/constants.h"
#include "read.h"

namespace avatar {

static constexpr uint32_t known_major = 1, known_minor = 0;
static const char* const update = "update the player";

namespace {

struct Version {
    uint32_t major, minor;
};

}  // namespace

/// Digits of a whole number without leading zeros; false where there are none, or more than nine.
static bool read_part(Text text, uint32_t* at, uint32_t* into) {
    const uint32_t begin = *at;
    *into = 0;
    while (*at < text.size && text.data[*at] >= '0' && text.data[*at] <= '9' && *at - begin < 10) {
        *into = 10 * *into + static_cast<uint32_t>(text.data[(*at)++] - '0');
    }
    const uint32_t digits = *at - begin;
    return digits >= 1 && digits <= 9 && (digits == 1 || text.data[begin] != '0');
}

static bool read_version(Text text, Version* into) {
    uint32_t at = 0;
    if (!read_part(text, &at, &into->major) || at == text.size || text.data[at++] != '.') return false;
    return read_part(text, &at, &into->minor) && at == text.size;
}

bool is_version(Text text) {
    Version read;
    return read_version(text, &read);
}

static Version parsed(Json said) {
    Version found = {0, 0};
    if (!said.is(JsonKind::text) || !read_version(said.text(), &found)) said.fail("\"MAJOR.MINOR\" is needed");
    return found;
}

void check_version(Json document, Errors& errors) {
    const Json asset = document.at("asset");
    const Version version = parsed(asset.at("version")), least = parsed(asset.at("minVersion"));
    if (version.major != known_major || least.major > known_major ||
        (least.major == known_major && least.minor > known_minor)) {
        errors.set("$.asset.version", "is %u.%u (needs a reader of %u.%u); this player knows %u.%u: %s", version.major,
                   version.minor, least.major, least.minor, known_major, known_minor, update);
    }
    for (Json one : document.at("extensionsRequired").items()) {
        const Text name = one.is(JsonKind::text) ? one.text() : Text("this");
        errors.set("$.extensionsRequired", "'%s' is not known to this player: %s", Cut(name, 80).data, update);
    }
}

void check_shaders(Json document, Errors& errors) {
    const double shaders = document.at("shaders").number();
    if (shaders > shader_version) {
        errors.set("$.shaders", "needs kernels of version %.0f; this player has %u: %s", shaders, shader_version, update);
    }
}

}  // namespace avatar
