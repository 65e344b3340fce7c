// Generated from hlsl/composite.hlsl, entry composite_vertex, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct vertexOutput_0
{
    @builtin(position) output_0 : vec4<f32>,
};

@vertex
fn composite_vertex(@builtin(vertex_index) vertex_0 : u32) -> vertexOutput_0
{
    var _S1 : i32;
    if(vertex_0 == u32(1))
    {
        _S1 = i32(3);
    }
    else
    {
        _S1 = i32(-1);
    }
    var _S2 : f32 = f32(_S1);
    if(vertex_0 == u32(2))
    {
        _S1 = i32(3);
    }
    else
    {
        _S1 = i32(-1);
    }
    var _S3 : vertexOutput_0 = vertexOutput_0( vec4<f32>(_S2, f32(_S1), 0.0f, 1.0f) );
    return _S3;
}

