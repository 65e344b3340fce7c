// Generated from hlsl/raster_gather.hlsl, entry raster_gather, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_RasterGatherConstants_std140_0
{
    @align(16) count_0 : u32,
    @align(4) begin_0 : u32,
    @align(8) piece_count_0 : u32,
    @align(4) first_0 : u32,
    @align(16) chunk_count_0 : u32,
    @align(4) reverse_0 : u32,
};

@binding(8) @group(0) var<uniform> RasterGatherConstants_0 : SLANG_ParameterGroup_RasterGatherConstants_std140_0;
@binding(1) @group(0) var<storage, read> Pairs_0 : array<vec2<u32>>;

@binding(0) @group(0) var<storage, read> Projected_0 : array<vec4<f32>>;

@binding(2) @group(0) var<storage, read_write> Quads_0 : array<vec4<f32>>;

@compute
@workgroup_size(64, 1, 1)
fn raster_gather(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var instance_0 : u32 = id_0.x;
    if(instance_0 >= (RasterGatherConstants_0.piece_count_0))
    {
        return;
    }
    var rank_0 : u32 = RasterGatherConstants_0.begin_0 + instance_0;
    var _S1 : u32;
    if((RasterGatherConstants_0.reverse_0) != u32(0))
    {
        _S1 = RasterGatherConstants_0.count_0 - u32(1) - rank_0;
    }
    else
    {
        _S1 = rank_0;
    }
    var row_0 : u32 = Pairs_0[_S1].y - RasterGatherConstants_0.first_0;
    if(row_0 >= (RasterGatherConstants_0.chunk_count_0))
    {
        return;
    }
    var place_0 : vec4<f32> = Projected_0[row_0];
    var conic_0 : vec4<f32> = Projected_0[RasterGatherConstants_0.chunk_count_0 + row_0];
    var rgb_0 : vec4<f32> = Projected_0[u32(2) * RasterGatherConstants_0.chunk_count_0 + row_0];
    var _S2 : u32 = u32(3) * instance_0;
    Quads_0[_S2] = vec4<f32>(place_0.xy, rgb_0.w, place_0.w);
    Quads_0[_S2 + u32(1)] = vec4<f32>(conic_0.xyz, 0.0f);
    Quads_0[_S2 + u32(2)] = vec4<f32>(rgb_0.xyz, 0.0f);
    return;
}

