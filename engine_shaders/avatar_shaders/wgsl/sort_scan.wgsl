// Generated from hlsl/sort_scan.hlsl, entry sort_scan, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_SortScanConstants_std140_0
{
    @align(16) total_0 : u32,
};

@binding(8) @group(0) var<uniform> SortScanConstants_0 : SLANG_ParameterGroup_SortScanConstants_std140_0;
@binding(0) @group(0) var<storage, read_write> Counts_0 : array<u32>;

var<workgroup> sums_0 : array<u32, i32(128)>;

@compute
@workgroup_size(128, 1, 1)
fn sort_scan(@builtin(local_invocation_id) thread_0 : vec3<u32>)
{
    var lane_0 : u32 = thread_0.x;
    var share_0 : u32 = (SortScanConstants_0.total_0 + u32(128) - u32(1)) / u32(128);
    var _S1 : u32 = min(lane_0 * share_0, SortScanConstants_0.total_0);
    var _S2 : u32 = min(_S1 + share_0, SortScanConstants_0.total_0);
    var i_0 : u32 = _S1;
    var sum_0 : u32 = u32(0);
    for(;;)
    {
        if(i_0 < _S2)
        {
        }
        else
        {
            break;
        }
        var sum_1 : u32 = sum_0 + Counts_0[i_0];
        i_0 = i_0 + u32(1);
        sum_0 = sum_1;
    }
    sums_0[lane_0] = sum_0;
    workgroupBarrier();
    var j_0 : u32;
    var place_0 : u32;
    if(lane_0 == u32(0))
    {
        j_0 = u32(0);
        place_0 = u32(0);
        for(;;)
        {
            if(j_0 < u32(128))
            {
            }
            else
            {
                break;
            }
            var own_0 : u32 = sums_0[j_0];
            sums_0[j_0] = place_0;
            var before_0 : u32 = place_0 + own_0;
            j_0 = j_0 + u32(1);
            place_0 = before_0;
        }
    }
    workgroupBarrier();
    j_0 = _S1;
    place_0 = sums_0[lane_0];
    for(;;)
    {
        if(j_0 < _S2)
        {
        }
        else
        {
            break;
        }
        var own_1 : u32 = Counts_0[j_0];
        Counts_0[j_0] = place_0;
        var place_1 : u32 = place_0 + own_1;
        j_0 = j_0 + u32(1);
        place_0 = place_1;
    }
    return;
}

