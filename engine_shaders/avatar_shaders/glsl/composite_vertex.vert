#version 310 es
// Generated from hlsl/composite.hlsl, entry composite_vertex, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1

vec4 _composite_vertex(uint vertex)
{
    return vec4(float((vertex == 1u) ? 3 : (-1)), float((vertex == 2u) ? 3 : (-1)), 0.0, 1.0);
}

void main()
{
    uint vertex = uint(gl_VertexID);
    uint param = vertex;
    gl_Position = _composite_vertex(param);
    gl_Position.z = 2.0 * gl_Position.z - gl_Position.w;
}

