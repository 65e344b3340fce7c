#pragma once
#include <string>
#include <utility>
#include <vector>

#ifdef _WIN32
constexpr const char* default_api = "d3d11";
#else
constexpr const char* default_api = "es";
#endif

/// What avatar_play is asked for.
struct Options {
    std::string pack;
    std::string clip;       // by name
    std::string recording;  // a CSV file of Live Link Face
    std::vector<std::pair<std::string, double>> expressions;
    std::string light;  // a JSON file; empty: as trained
    int width = 512, height = 512;
    double yaw = 0, pitch = 0;  // degrees
    unsigned level = 0;
    int frames = 1;
    double fps = 30;
    std::string out;  // "%03d" in it is the number of the frame; empty: nothing is written
    std::string api = default_api;  // es, gl or d3d11
    int target = -1;  // AVATAR_GLES_RGBA32F ..; below 0: the most exact one
    bool timings = false;
    bool window = false;
};

/// Reads the command line. Returns false after a message.
bool parse(const std::vector<std::string>& words, Options& into);

/// The name of a frame's file.
std::string frame_name(const std::string& pattern, int frame);
