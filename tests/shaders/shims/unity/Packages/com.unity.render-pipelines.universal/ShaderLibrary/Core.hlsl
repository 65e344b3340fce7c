// Stands in for the render pipeline's file in tests: what AvatarSplatURP.shader takes from it, and nothing else.
float4 _ProjectionParams;
