// Generated from hlsl/sort_scatter.hlsl, entry sort_scatter, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_SortScatterConstants_std140_0
{
    @align(16) count_0 : u32,
    @align(4) groups_0 : u32,
    @align(8) shift_0 : u32,
};

@binding(8) @group(0) var<uniform> SortScatterConstants_0 : SLANG_ParameterGroup_SortScatterConstants_std140_0;
@binding(0) @group(0) var<storage, read> Pairs_0 : array<vec2<u32>>;

@binding(1) @group(0) var<storage, read> Counts_0 : array<u32>;

@binding(2) @group(0) var<storage, read_write> PairsOut_0 : array<vec2<u32>>;

var<workgroup> places_0 : array<u32, i32(1024)>;

fn sort_digit_0( key_0 : u32,  shift_1 : u32) -> u32
{
    return (((key_0 >> (shift_1))) & (u32(15)));
}

@compute
@workgroup_size(64, 1, 1)
fn sort_scatter(@builtin(workgroup_id) group_0 : vec3<u32>, @builtin(local_invocation_id) thread_0 : vec3<u32>)
{
    var lane_0 : u32 = thread_0.x;
    var _S1 : u32 = group_0.x;
    var _S2 : u32 = min(_S1 * u32(1024) + lane_0 * u32(16), SortScatterConstants_0.count_0);
    var _S3 : u32 = min(_S2 + u32(16), SortScatterConstants_0.count_0);
    var d_0 : u32 = u32(0);
    for(;;)
    {
        if(d_0 < u32(16))
        {
        }
        else
        {
            break;
        }
        places_0[d_0 * u32(64) + lane_0] = u32(0);
        d_0 = d_0 + u32(1);
    }
    var i_0 : u32 = _S2;
    for(;;)
    {
        if(i_0 < _S3)
        {
        }
        else
        {
            break;
        }
        places_0[sort_digit_0(Pairs_0[i_0].x, SortScatterConstants_0.shift_0) * u32(64) + lane_0] = places_0[sort_digit_0(Pairs_0[i_0].x, SortScatterConstants_0.shift_0) * u32(64) + lane_0] + u32(1);
        i_0 = i_0 + u32(1);
    }
    workgroupBarrier();
    var j_0 : u32;
    if(lane_0 < u32(16))
    {
        var _S4 : u32 = Counts_0[lane_0 * SortScatterConstants_0.groups_0 + _S1];
        j_0 = u32(0);
        var place_0 : u32 = _S4;
        for(;;)
        {
            if(j_0 < u32(64))
            {
            }
            else
            {
                break;
            }
            var own_0 : u32 = places_0[lane_0 * u32(64) + j_0];
            places_0[lane_0 * u32(64) + j_0] = place_0;
            var place_1 : u32 = place_0 + own_0;
            j_0 = j_0 + u32(1);
            place_0 = place_1;
        }
    }
    workgroupBarrier();
    j_0 = _S2;
    for(;;)
    {
        if(j_0 < _S3)
        {
        }
        else
        {
            break;
        }
        var pair_0 : vec2<u32> = Pairs_0[j_0];
        PairsOut_0[places_0[sort_digit_0(pair_0.x, SortScatterConstants_0.shift_0) * u32(64) + lane_0]] = pair_0;
        places_0[sort_digit_0(pair_0.x, SortScatterConstants_0.shift_0) * u32(64) + lane_0] = places_0[sort_digit_0(pair_0.x, SortScatterConstants_0.shift_0) * u32(64) + lane_0] + u32(1);
        j_0 = j_0 + u32(1);
    }
    return;
}

