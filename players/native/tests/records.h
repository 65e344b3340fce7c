#pragma once
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

// What the probes read and write: a file is records, each u32 bytes of its name, the name, u64 bytes, the bytes.

/// Writes records to a file.
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

/// All bytes of a file.
inline std::vector<uint8_t> read_file(const std::string& path) {
    std::vector<uint8_t> bytes;
    FILE* file = std::fopen(path.c_str(), "rb");
    if (file == nullptr) return bytes;
    uint8_t piece[1 << 16];
    for (size_t count; (count = std::fread(piece, 1, sizeof(piece), file)) > 0;) {
        bytes.insert(bytes.end(), piece, piece + count);
    }
    std::fclose(file);
    return bytes;
}

/// Numbers of a file.
template <class T>
std::vector<T> read_numbers(const std::string& path) {
    const std::vector<uint8_t> bytes = read_file(path);
    const T* begin = reinterpret_cast<const T*>(bytes.data());
    return bytes.empty() ? std::vector<T>() : std::vector<T>(begin, begin + bytes.size() / sizeof(T));
}
