#pragma once
#include <cstdint>

/// Writes rgba [height, width, 4], first row on top, as a PNG without compression. False where it cannot be written.
bool write_png(const char* path, const uint8_t* rgba, uint32_t width, uint32_t height);
