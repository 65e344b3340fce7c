// Stage `raster` for Unity: pass Splat draws into a float image, pass Composite brings it to the camera's target. The
// passes are drawn by command buffers alone and take nothing from a render pipeline: the same text serves Built-in, URP
// and HDRP. HDRP's target is exposed already, so colours are written as they are: no light and no exposure changes them.
// The Editor waits for both to be compiled: it would draw something else meanwhile, and Conform draws once.
Shader "Avatar/Splat"
{
    SubShader
    {
        Tags { "Queue" = "Transparent" "RenderType" = "Transparent" "IgnoreProjector" = "True" }

        Pass
        {
            Name "Splat"
            ZWrite Off
            ZTest Always
            Cull Off
            Blend One OneMinusSrcAlpha // back to front: raster_gather with reverse = 1

            HLSLPROGRAM
            #pragma target 4.5
            #pragma editor_sync_compilation
            #pragma vertex vert
            #pragma fragment frag
            // Where vertex shaders have no storage buffers; where the depth texture has a slice for each eye.
            #pragma multi_compile_local _ AVATAR_QUAD_TEXTURE
            #pragma multi_compile_local _ AVATAR_DEPTH_ARRAY
            #define AVATAR_LOOSE_CONSTANTS 1
            #include "../../unity_quad.hlsl"

            SplatFragment vert(uint vertex : SV_VertexID, uint batch : SV_InstanceID)
            {
                return splat_vertex(vertex, batch);
            }

            float4 frag(SplatFragment splat) : SV_Target
            {
                return splat_pixel(splat);
            }
            ENDHLSL
        }

        Pass
        {
            Name "Composite"
            ZWrite Off
            ZTest Always
            Cull Off
            Blend One OneMinusSrcAlpha

            HLSLPROGRAM
            #pragma target 4.5
            #pragma editor_sync_compilation
            #pragma vertex vert
            #pragma fragment frag
            #define AVATAR_LOOSE_CONSTANTS 1
            #include "../../unity_composite.hlsl"

            float4 vert(uint vertex : SV_VertexID) : SV_Position
            {
                return composite_vertex(vertex);
            }

            float4 frag(float4 position : SV_Position) : SV_Target
            {
                return composite_target(position);
            }
            ENDHLSL
        }
    }
}
