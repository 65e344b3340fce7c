// What gles_desk needs beside the library: files, an end with a line, an allocator that counts.
#pragma once

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

using Bytes = std::vector<char>;

/// An allocator that counts.
struct Counted {
    long calls = 0, live_bytes = 0;

    static void* take(void* user, size_t bytes) {
        Counted* self = static_cast<Counted*>(user);
        self->calls++;
        self->live_bytes += static_cast<long>(bytes);
        return std::malloc(bytes);
    }
    static void give(void* user, void* memory, size_t bytes) {
        static_cast<Counted*>(user)->live_bytes -= static_cast<long>(bytes);
        std::free(memory);
    }
};

[[noreturn]] inline void stop(const std::string& line) {
    std::fprintf(stderr, "%s\n", line.c_str());
    std::exit(3);
}

inline void must(int good, const char* line) {
    if (good == 0) stop(line != nullptr ? line : "failed without a line");
}

inline Bytes read_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) stop(path + ": cannot be read");
    return Bytes(std::istreambuf_iterator<char>(file), {});
}

inline void write_file(const std::string& path, const void* from, size_t size) {
    std::ofstream(path, std::ios::binary).write(static_cast<const char*>(from), static_cast<std::streamsize>(size));
}
