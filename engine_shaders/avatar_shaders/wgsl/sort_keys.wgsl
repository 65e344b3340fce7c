// Generated from hlsl/sort_keys.hlsl, entry sort_keys, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_SortKeysConstants_std140_0
{
    @align(16) count_0 : u32,
    @align(4) first_0 : u32,
};

@binding(8) @group(0) var<uniform> SortKeysConstants_0 : SLANG_ParameterGroup_SortKeysConstants_std140_0;
@binding(1) @group(0) var<storage, read_write> Pairs_0 : array<vec2<u32>>;

@binding(0) @group(0) var<storage, read> Projected_0 : array<vec4<f32>>;

fn sort_key_0( depth_0 : f32,  radius_0 : f32) -> u32
{
    var _S1 : u32;
    if(radius_0 > 0.0f)
    {
        _S1 = (bitcast<u32>((depth_0)));
    }
    else
    {
        _S1 = u32(4294967295);
    }
    return _S1;
}

@compute
@workgroup_size(64, 1, 1)
fn sort_keys(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_0 : u32 = id_0.x;
    if(row_0 >= (SortKeysConstants_0.count_0))
    {
        return;
    }
    Pairs_0[SortKeysConstants_0.first_0 + row_0] = vec2<u32>(sort_key_0(Projected_0[row_0].z, Projected_0[SortKeysConstants_0.count_0 + row_0].w), SortKeysConstants_0.first_0 + row_0);
    return;
}

