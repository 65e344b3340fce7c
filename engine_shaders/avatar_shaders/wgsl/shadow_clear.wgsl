// Generated from hlsl/shadow_clear.hlsl, entry shadow_clear, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_ShadowClearConstants_std140_0
{
    @align(16) texels_0 : u32,
};

@binding(8) @group(0) var<uniform> ShadowClearConstants_0 : SLANG_ParameterGroup_ShadowClearConstants_std140_0;
@binding(0) @group(0) var<storage, read_write> Shadow_0 : array<atomic<u32>>;

@compute
@workgroup_size(64, 1, 1)
fn shadow_clear(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var _S1 : u32 = id_0.x;
    if(_S1 < (ShadowClearConstants_0.texels_0))
    {
        atomicStore(&(Shadow_0[_S1]), u32(2130706432));
    }
    return;
}

