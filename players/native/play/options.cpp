#include "options.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>

static const char usage[] =
    "avatar_play PACK [options]\n"
    "  --clip NAME | --recording CSV   what moves it\n"
    "  --expression NAME=WEIGHT        as often as you like\n"
    "  --light FILE.json               the light of the scene, for packs that are relit\n"
    "  --size WIDTHxHEIGHT             of the image: 512x512\n"
    "  --yaw DEGREES --pitch DEGREES   where the camera stands: 0, 0 is the front\n"
    "  --level N                       of detail, 0 the finest\n"
    "  --frames N --fps N              how many, how far apart: 1, 30\n"
    "  -o FRAME_%03d.png               writes them\n"
    "  --api es|gl|d3d11               OpenGL ES 3.1, OpenGL 4.3 or Direct3D 11; --es and --gl are short for it\n"
    "  --target rgba32f|rgba16f|rgba8  the image into which splats are blended: the most exact one\n"
    "  --timings                       prints milliseconds of each stage\n"
    "  --window                        shows it, where the program was built with X11\n";

static bool complain(const char* option, const char* reason) {
    std::fprintf(stderr, "%s: %s\n%s", option, reason, usage);
    return false;
}

static bool number(const char* text, double& into) {
    char* end = nullptr;
    into = std::strtod(text, &end);
    return end != text && *end == 0;
}

static bool whole(const char* text, double least, double most, double& into) {
    return number(text, into) && into >= least && into <= most && into == static_cast<double>(static_cast<long>(into));
}

static bool take_expression(const std::string& text, Options& into) {
    const size_t at = text.find('=');
    double weight = 0;
    if (at == std::string::npos || !number(text.c_str() + at + 1, weight)) return false;
    into.expressions.emplace_back(text.substr(0, at), weight);
    return true;
}

static bool take_target(const char* text, Options& into) {
    static const char* const names[] = {"rgba32f", "rgba16f", "rgba8"};
    for (int i = 0; i < 3; i++) {
        if (std::strcmp(text, names[i]) == 0) into.target = i;
    }
    return into.target >= 0;
}

static bool take_api(const std::string& text, Options& into) {
    into.api = text;
    return text == "es" || text == "gl" || text == "d3d11";
}

static bool take_size(const char* text, Options& into) {
    int used = 0;
    return std::sscanf(text, "%5dx%5d%n", &into.width, &into.height, &used) == 2 && text[used] == 0 && into.width > 0 &&
           into.height > 0;
}

/// Takes an option with a value. False where the value is not one.
static bool take(const std::string& option, const char* value, Options& into) {
    double found = 0;
    bool good = true;
    if (option == "--clip") into.clip = value;
    else if (option == "--recording") into.recording = value;
    else if (option == "--light") into.light = value;
    else if (option == "-o") into.out = value;
    else if (option == "--api") good = take_api(value, into);
    else if (option == "--expression") good = take_expression(value, into);
    else if (option == "--size") good = take_size(value, into);
    else if (option == "--target") good = take_target(value, into);
    else if (option == "--yaw") good = number(value, into.yaw);
    else if (option == "--pitch") good = number(value, into.pitch);
    else if (option == "--fps") good = number(value, into.fps) && into.fps > 0;
    else if (option == "--level" && (good = whole(value, 0, 255, found))) into.level = static_cast<unsigned>(found);
    else if (option == "--frames" && (good = whole(value, 1, 1e6, found))) into.frames = static_cast<int>(found);
    return good;
}

bool parse(const std::vector<std::string>& words, Options& into) {
    static const char* const with_value[] = {"--clip", "--recording", "--light", "-o", "--api", "--expression", "--size", "--target", "--yaw",
                                             "--pitch", "--fps", "--level", "--frames"};
    for (size_t i = 1; i < words.size(); i++) {
        const std::string& word = words[i];
        bool takes = false;
        for (const char* option : with_value) takes = takes || word == option;
        if (takes && i + 1 == words.size()) return complain(word.c_str(), "needs a value");
        if (takes && !take(word, words[i + 1].c_str(), into)) return complain(word.c_str(), "takes no such value");
        if (takes) i++;
        else if (word == "--es" || word == "--gl") into.api = word.substr(2);
        else if (word == "--timings") into.timings = true;
        else if (word == "--window") into.window = true;
        else if (word[0] == '-' || !into.pack.empty()) return complain(word.c_str(), "is not understood");
        else into.pack = word;
    }
    if (into.pack.empty()) return complain("avatar_play", "name a pack");
    if (!into.window && into.frames > 1 && !into.out.empty() && frame_name(into.out, 0) == frame_name(into.out, 1)) {
        return complain(into.out.c_str(), "would hold every frame; write %03d where its number goes");
    }
    if (!into.clip.empty() && !into.recording.empty()) return complain("--clip", "not together with --recording");
    return true;
}

std::string frame_name(const std::string& pattern, int frame) {
    const size_t at = pattern.find('%');
    const size_t end = at == std::string::npos ? at : pattern.find('d', at);
    if (end == std::string::npos) return pattern;
    const int digits = std::atoi(pattern.c_str() + at + 1);
    char number[32];
    std::snprintf(number, sizeof number, "%0*d", digits < 1 ? 1 : digits > 20 ? 20 : digits, frame);
    return pattern.substr(0, at) + number + pattern.substr(end + 1);
}
