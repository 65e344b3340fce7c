#pragma once
#include <string>
#include <utility>
#include <vector>

/// What avatar_play is asked for.
struct Options {
    std::string pack;
    std::string clip;       // by name
    std::string recording;  // a CSV file of Live Link Face
    std::vector<std::pair<std::string, double>> expressions;
    int width = 512, height = 512;
    double yaw = 0, pitch = 0;  // degrees
    unsigned level = 0;
    int frames = 1;
    double fps = 30;
    std::string out;  // "%03d" in it is the number of the frame; empty: nothing is written
    bool es = true;
    int target = -1;  // AVATAR_GLES_RGBA32F ..; below 0: the most exact one
    bool timings = false;
    bool window = false;
};

/// Reads the command line. Returns false after a message.
bool parse(int count, char** words, Options& into);

/// The name of a frame's file.
std::string frame_name(const std::string& pattern, int frame);
