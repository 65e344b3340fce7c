// Stage `raster` for Unity, Universal render pipeline: pass Splat draws into a float target, pass Composite brings it to the
// camera's target. Both run with the camera whose target they share, so that rows and depth agree.
Shader "Avatar/SplatURP"
{
    Properties
    {
        [HideInInspector] flip_y ("1: the passes turn the rows themselves", Float) = 1
        [HideInInspector] flip_rows ("0: both targets have the same rows", Float) = 0
        linear_target ("1: the camera's target holds linear light", Float) = 1
        background ("display-referred rgb; alpha 1 opaque, 0 keeps what is drawn already", Vector) = (0, 0, 0, 0)
    }
    SubShader
    {
        Tags { "Queue" = "Transparent" "RenderType" = "Transparent" "IgnoreProjector" = "True" "RenderPipeline" = "UniversalPipeline" }

        Pass
        {
            Name "Splat"
            ZWrite Off
            ZTest LEqual
            Cull Off
            Blend One OneMinusSrcAlpha // back to front: raster_gather with reverse = 1

            HLSLPROGRAM
            #pragma target 4.5
            #pragma vertex vert
            #pragma fragment frag
            #include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Core.hlsl"
            #define AVATAR_LOOSE_CONSTANTS 1
            #include "raster.hlsl"
            #include "unity_clip.hlsl"

            QuadFragment vert(uint vertex : SV_VertexID, uint instance : SV_InstanceID)
            {
                QuadFragment q = raster_vertex_fetch(vertex, instance);
                q.position = unity_clip(q.position);
                return q;
            }

            float4 frag(QuadFragment q) : SV_Target
            {
                q.position.y = row_from_top(q.position.y, image_size.y);
                return raster_pixel(q);
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
            #pragma vertex vert
            #pragma fragment frag
            #include "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Core.hlsl"
            #define AVATAR_LOOSE_CONSTANTS 1
            #include "composite.hlsl"

            float4 vert(uint vertex : SV_VertexID) : SV_Position
            {
                return composite_vertex(vertex);
            }

            float4 frag(float4 position : SV_Position) : SV_Target
            {
                return composite_pixel(position);
            }
            ENDHLSL
        }
    }
}
