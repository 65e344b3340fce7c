#pragma once
#include <cstddef>
#include <cstdint>

namespace avatar {

/// The checksum of gzip, of bytes behind those that have the checksum `before`.
uint32_t crc32(const uint8_t* bytes, size_t size, uint32_t before = 0);

}  // namespace avatar
