// Stage `shadow`, first step, one thread a texel: nothing casts a shadow.
// Reads: nothing. Writes: Shadow.
#include "platform.hlsli"

AVATAR_LEAST_BUFFER(Shadow); // [texels] bits of the least distance

AVATAR_CONSTANTS(ShadowClearConstants)
    uint texels;
AVATAR_CONSTANTS_END

[numthreads(AVATAR_THREADS, 1, 1)]
void shadow_clear(uint3 id : SV_DispatchThreadID)
{
    if (id.x < texels)
    {
        AVATAR_LEAST_CLEAR(Shadow, id.x, 0x7F000000u); // the bits of 1.7e38
    }
}
