#pragma once
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <d3d11.h>
#include <d3dcompiler.h>

#include "../src/formats/memory.h"

namespace avatar {

/// Releases what is there.
template <class T>
void drop(T*& one) {
    if (one != nullptr) one->Release();
    one = nullptr;
}

}  // namespace avatar
