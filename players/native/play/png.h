#pragma once
#include <cstdint>
#include <string>

/// Writes rgba [height, width, 4], first row on top, as a PNG without compression. False where it cannot be written.
bool write_png(const std::string& path, const uint8_t* rgba, uint32_t width, uint32_t height);
