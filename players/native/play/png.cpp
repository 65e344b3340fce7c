#include "png.h"

#include <cstdio>
#include <cstring>
#include <vector>

#include "files.h"

namespace {

/// Bytes of a file, with the sums that its parts end with.
struct Bytes {
    std::vector<uint8_t> data;

    void put(uint32_t value) {
        for (int shift = 24; shift >= 0; shift -= 8) data.push_back(static_cast<uint8_t>(value >> shift));
    }
    void put(const void* from, size_t size) {
        const uint8_t* at = static_cast<const uint8_t*>(from);
        data.insert(data.end(), at, at + size);
    }
};

/// CRC-32 of ISO 3309, as PNG asks for it.
uint32_t crc(const uint8_t* at, size_t size) {
    uint32_t sum = 0xFFFFFFFF;
    for (size_t i = 0; i < size; i++) {
        sum ^= at[i];
        for (int bit = 0; bit < 8; bit++) sum = (sum >> 1) ^ ((sum & 1) != 0 ? 0xEDB88320u : 0);
    }
    return ~sum;
}

/// Adler-32, as zlib asks for it.
uint32_t adler(const std::vector<uint8_t>& data) {
    uint32_t a = 1, b = 0;
    for (const uint8_t byte : data) {
        a = (a + byte) % 65521;
        b = (b + a) % 65521;
    }
    return b << 16 | a;
}

void put_chunk(Bytes& file, const char* name, const Bytes& content) {
    file.put(static_cast<uint32_t>(content.data.size()));
    const size_t from = file.data.size();
    file.put(name, 4);
    file.put(content.data.data(), content.data.size());
    file.put(crc(&file.data[from], file.data.size() - from));
}

/// A stream of zlib with stored blocks.
Bytes stored(const std::vector<uint8_t>& raw) {
    Bytes made;
    made.put("\x78\x01", 2);
    for (size_t at = 0; at < raw.size();) {
        const size_t size = raw.size() - at < 65535 ? raw.size() - at : 65535;
        const uint8_t head[] = {at + size == raw.size(), static_cast<uint8_t>(size), static_cast<uint8_t>(size >> 8),
                                static_cast<uint8_t>(~size), static_cast<uint8_t>(~size >> 8)};
        made.put(head, sizeof head);
        made.put(&raw[at], size);
        at += size;
    }
    made.put(adler(raw));
    return made;
}

}  // namespace

bool write_png(const std::string& path, const uint8_t* rgba, uint32_t width, uint32_t height) {
    std::vector<uint8_t> rows;  // each begins with the number of its filter: 0, none
    for (size_t y = 0; y < height; y++) {
        rows.push_back(0);
        rows.insert(rows.end(), rgba + 4 * width * y, rgba + 4 * width * (y + 1));
    }
    Bytes file, head;
    file.put("\x89PNG\r\n\x1a\n", 8);
    head.put(width);
    head.put(height);
    head.put("\x08\x06\0\0\0", 5);  // 8 bits, rgba
    put_chunk(file, "IHDR", head);
    put_chunk(file, "IDAT", stored(rows));
    put_chunk(file, "IEND", Bytes());
    std::FILE* out = open_file(path, "wb");
    if (out == nullptr) return false;
    const bool good = std::fwrite(file.data.data(), 1, file.data.size(), out) == file.data.size();
    return std::fclose(out) == 0 && good;
}
