// Stands in for Unity's file in tests: what AvatarSplat.shader takes from it, and nothing else.
float4 _ProjectionParams;
