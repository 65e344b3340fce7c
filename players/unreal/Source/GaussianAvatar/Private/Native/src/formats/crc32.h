// Copy of players/native/src/formats/crc32.h by `python -m avatar_shaders`; do not edit.
#pragma once
#include <cstddef>
#include <cstdint>

namespace avatar {

/// The checksum of gzip.
uint32_t crc32(const uint8_t* bytes, size_t size);

}  // namespace avatar
