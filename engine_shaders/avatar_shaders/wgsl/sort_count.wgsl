// Generated from hlsl/sort_count.hlsl, entry sort_count, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_SortCountConstants_std140_0
{
    @align(16) count_0 : u32,
    @align(4) groups_0 : u32,
    @align(8) shift_0 : u32,
};

@binding(8) @group(0) var<uniform> SortCountConstants_0 : SLANG_ParameterGroup_SortCountConstants_std140_0;
@binding(0) @group(0) var<storage, read> Pairs_0 : array<vec2<u32>>;

@binding(1) @group(0) var<storage, read_write> Counts_0 : array<u32>;

var<workgroup> occurrences_0 : array<atomic<u32>, i32(16)>;

fn sort_digit_0( key_0 : u32,  shift_1 : u32) -> u32
{
    return (((key_0 >> (shift_1))) & (u32(15)));
}

@compute
@workgroup_size(64, 1, 1)
fn sort_count(@builtin(workgroup_id) group_0 : vec3<u32>, @builtin(local_invocation_id) thread_0 : vec3<u32>)
{
    var lane_0 : u32 = thread_0.x;
    var _S1 : bool = lane_0 < u32(16);
    if(_S1)
    {
        atomicStore(&(occurrences_0[lane_0]), u32(0));
    }
    workgroupBarrier();
    var i_0 : u32 = u32(0);
    for(;;)
    {
        if(i_0 < u32(16))
        {
        }
        else
        {
            break;
        }
        var at_0 : u32 = group_0.x * u32(1024) + i_0 * u32(64) + lane_0;
        if(at_0 < (SortCountConstants_0.count_0))
        {
            var _S2 : u32 = atomicAdd(&(occurrences_0[sort_digit_0(Pairs_0[at_0].x, SortCountConstants_0.shift_0)]), u32(1));
        }
        i_0 = i_0 + u32(1);
    }
    workgroupBarrier();
    if(_S1)
    {
        var _S3 : u32 = atomicLoad(&(occurrences_0[lane_0]));
        Counts_0[lane_0 * SortCountConstants_0.groups_0 + group_0.x] = _S3;
    }
    return;
}

