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

static Version parsed(Json said) {
    const Text text = said.text();
    Version found = {0, 0};
    uint32_t at = 0;
    bool fits = read_part(text, &at, &found.major) && at < text.size && text.data[at] == '.';
    at++;
    fits = fits && read_part(text, &at, &found.minor) && at == text.size;
    if (!fits) said.fail("\"MAJOR.MINOR\" is needed");
    return found;
}

void check_version(Json document, Arena& scratch) {
    static const char* const formats[] = {"avatar-pack"};
    Errors& errors = scratch.errors();
    const Json asset = document.at("asset");
    const Version version = parsed(asset.at("version")), least = parsed(asset.at("minVersion"));
    if (version.major != known_major || least.major > known_major ||
        (least.major == known_major && least.minor > known_minor)) {
        errors.set("$.asset.version", "is %u.%u (needs a reader of %u.%u); this player knows %u.%u: %s", version.major,
                   version.minor, least.major, least.minor, known_major, known_minor, update);
    }
    const Json required = document.at("extensionsRequired");
    if (required.given()) {
        Span<Text> names = required.names(scratch, scratch);
        if (!names.empty()) {
            errors.set("$.extensionsRequired", "'%s' is not known to this player: %s", Cut(names[0], 80).data, update);
        }
    }
    document.at("format").one(formats);
    const double shaders = document.at("shaders").whole(1);
    if (shaders > shader_version) {
        errors.set("$.shaders", "needs kernels of version %.0f; this player has %u: %s", shaders, shader_version, update);
    }
}

}  // namespace avatar
