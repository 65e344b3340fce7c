// Copy of avatar_shaders/hlsl/activate.hlsl, by `python -m avatar_shaders`; do not edit.
// Stage `activate`, one thread a Gaussian: scale, opacity and unit quaternion in place.
// Reads: nothing. Writes: Splats.
#include "platform_core.hlsl"
#include "activate_core.hlsl"

RWStructuredBuffer<float4> Splats; // [5 count]: mean and opacity; quaternion; 3 rows of sh_rotation with scale in w

AVATAR_CONSTANTS(ActivateConstants)
    uint count;
AVATAR_CONSTANTS_END

[numthreads(AVATAR_THREADS, 1, 1)]
void activate(uint3 id : SV_DispatchThreadID)
{
    uint row = id.x;
    if (row >= count)
    {
        return;
    }
    float4 mean = Splats[row];
    Splats[row] = float4(mean.xyz, activate_opacity(mean.w));
    Splats[count + row] = activate_quat(Splats[count + row]);
    float4 row0 = Splats[2 * count + row], row1 = Splats[3 * count + row], row2 = Splats[4 * count + row];
    float3 scale = activate_scale(float3(row0.w, row1.w, row2.w));
    Splats[2 * count + row] = float4(row0.xyz, scale.x);
    Splats[3 * count + row] = float4(row1.xyz, scale.y);
    Splats[4 * count + row] = float4(row2.xyz, scale.z);
}
