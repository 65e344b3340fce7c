// Generated from hlsl/shadow_clear.hlsl, entry shadow_clear, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
#pragma clang diagnostic ignored "-Wmissing-prototypes"

#include <metal_stdlib>
#include <simd/simd.h>

using namespace metal;

struct ShadowClearConstants
{
    uint texels;
};

struct Shadow
{
    uint _data[1];
};

static inline __attribute__((always_inline))
void _shadow_clear(thread const uint3& id, constant ShadowClearConstants& constants, device Shadow& Shadow_1)
{
    if (id.x < constants.texels)
    {
        Shadow_1._data[id.x] = 2130706432u;
    }
}

kernel void shadow_clear(device Shadow& Shadow_1 [[buffer(0)]], constant ShadowClearConstants& constants [[buffer(8)]], uint3 gl_GlobalInvocationID [[thread_position_in_grid]])
{
    uint3 id = gl_GlobalInvocationID;
    uint3 param = id;
    _shadow_clear(param, constants, Shadow_1);
}

