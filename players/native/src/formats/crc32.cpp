#include "crc32.h"

namespace avatar {

namespace {

struct CrcTables {
    uint32_t rows[16][256];

    CrcTables() {
        for (uint32_t i = 0; i < 256; i++) {
            uint32_t value = i;
            for (int bit = 0; bit < 8; bit++) value = (value & 1u) != 0 ? (value >> 1) ^ 0xedb88320u : value >> 1;
            rows[0][i] = value;
        }
        for (uint32_t i = 0; i < 256; i++) {
            for (int row = 1; row < 16; row++) rows[row][i] = rows[row - 1][i] >> 8 ^ rows[0][rows[row - 1][i] & 0xff];
        }
    }
};

}  // namespace

uint32_t crc32(const uint8_t* bytes, size_t size, uint32_t before) {
    static const CrcTables tables;
    const auto& t = tables.rows;
    uint32_t state = ~before;
    size_t at = 0;
    for (; at + 16 <= size; at += 16) {  // sixteen bytes a step, a table each
        uint32_t next = 0;
        for (size_t i = 0; i < 4; i++) next ^= t[15 - i][bytes[at + i] ^ (state >> (8 * i) & 0xff)];
        for (size_t i = 4; i < 16; i++) next ^= t[15 - i][bytes[at + i]];
        state = next;
    }
    for (; at < size; at++) state = state >> 8 ^ t[0][(state ^ bytes[at]) & 0xff];
    return ~state;
}

}  // namespace avatar
