#pragma once
#include "gl.h"

namespace avatar {

/// The linked shaders of a context. A kernel is compiled when it is first asked for.
class Programs {
public:
    explicit Programs(const Gl& gl) : gl_(gl) {}

    /// The program of a compute entry; 0 where the driver does not take it.
    uint32_t kernel(Errors& errors, const char* entry);

    /// A program that draws, of two texts; 0 as above. `what` is what errors call it. The caller frees it.
    uint32_t drawing(Errors& errors, const char* what, const char* vertex, const char* pixel);

    /// Frees the kernels.
    void release();

private:
    static constexpr uint32_t most = 32;

    struct Known {
        const char* entry;
        uint32_t program;
    };

    uint32_t compiled(Errors& errors, const char* what, uint32_t kind, const char* text);
    uint32_t linked(Errors& errors, const char* what, const uint32_t* shaders, uint32_t count);

    const Gl& gl_;
    Known known_[most] = {};
    uint32_t count_ = 0;
};

}  // namespace avatar
