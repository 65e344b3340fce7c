// What the programs of the tests need beside the library: files, records of a file, an allocator that counts.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "avatar_player.h"

using Bytes = std::vector<uint8_t>;

/// All bytes of a file; none where it cannot be read.
inline Bytes read_file(const std::string& path) {
    Bytes bytes;
    FILE* file = std::fopen(path.c_str(), "rb");
    if (file == nullptr) return bytes;
    uint8_t piece[1 << 16];
    for (size_t count; (count = std::fread(piece, 1, sizeof(piece), file)) > 0;) bytes.insert(bytes.end(), piece, piece + count);
    std::fclose(file);
    return bytes;
}

/// Numbers of a file.
template <class T>
std::vector<T> read_numbers(const std::string& path) {
    const Bytes bytes = read_file(path);
    const T* begin = reinterpret_cast<const T*>(bytes.data());
    return bytes.empty() ? std::vector<T>() : std::vector<T>(begin, begin + bytes.size() / sizeof(T));
}

/// The files of a stream: each has its length before it.
inline std::vector<Bytes> read_files(const std::string& path) {
    const Bytes stream = read_file(path);
    std::vector<Bytes> files;
    for (const uint8_t* at = stream.data(); at + 4 <= stream.data() + stream.size(); at += files.back().size()) {
        const size_t length = at[0] | size_t{at[1]} << 8 | size_t{at[2]} << 16 | size_t{at[3]} << 24;
        at += 4;
        files.emplace_back(at, at + length);
    }
    return files;
}

/// Writes records to a file: each u32 bytes of its name, the name, u64 bytes, the bytes.
class Records {
public:
    explicit Records(const char* path) : file_(std::fopen(path, "wb")) {}
    ~Records() {
        if (file_ != nullptr) std::fclose(file_);
    }
    Records(const Records&) = delete;
    Records& operator=(const Records&) = delete;

    bool sound() const { return file_ != nullptr; }

    void add(const std::string& name, const void* bytes, size_t size) {
        const uint32_t length = static_cast<uint32_t>(name.size());
        const uint64_t count = size;
        std::fwrite(&length, 4, 1, file_);
        std::fwrite(name.data(), 1, name.size(), file_);
        std::fwrite(&count, 8, 1, file_);
        if (size > 0) std::fwrite(bytes, 1, size, file_);
    }
    void text(const std::string& name, const char* value) {
        const std::string held = value == nullptr ? "" : value;
        add(name, held.data(), held.size());
    }

private:
    FILE* file_;
};

/// An allocator that counts, and fails at its n-th call.
struct Counter {
    size_t calls = 0, blocks = 0, bytes = 0, fails_at = SIZE_MAX;

    AvatarAllocator allocator() {
        const auto allocate = [](void* user, size_t size) -> void* {
            Counter& own = *static_cast<Counter*>(user);
            if (own.calls++ == own.fails_at) return nullptr;
            own.blocks++;
            own.bytes += size;
            return std::malloc(size);
        };
        const auto release = [](void* user, void* memory, size_t size) {
            Counter& own = *static_cast<Counter*>(user);
            own.blocks--;
            own.bytes -= size;
            std::free(memory);
        };
        return {sizeof(AvatarAllocator), allocate, release, this};
    }
};
