// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
using System.Collections.Generic;

namespace AvatarExport.Core
{
    /// <summary>What the shaders bind.</summary>
    public static class Interfaces
    {
        /// <summary>Every compute entry of the shaders, by name.</summary>
        public static readonly Dictionary<string, Interface> All = new Dictionary<string, Interface>
        {
            ["morph"] = new Interface(
                "morph",
                64,
                new[]
                {
                    new StorageBuffer("MorphStatic", 4, true),
                    new StorageBuffer("Pose", 4, true),
                    new StorageBuffer("Mesh", 16, false),
                },
                new[]
                {
                    new Member("first", 0, "uint"),
                    new Member("count", 4, "uint"),
                    new Member("vertices", 8, "uint"),
                    new Member("template_position", 12, "uint"),
                    new Member("template_position_width", 16, "uint"),
                    new Member("template_position_scale", 20, "uint"),
                    new Member("morph_ptr", 24, "uint"),
                    new Member("morph_column", 28, "uint"),
                    new Member("morph_column_width", 32, "uint"),
                    new Member("morph_position", 36, "uint"),
                    new Member("morph_position_width", 40, "uint"),
                    new Member("morph_position_step", 44, "uint"),
                    new Member("corrective_ptr", 48, "uint"),
                    new Member("corrective_column", 52, "uint"),
                    new Member("corrective_column_width", 56, "uint"),
                    new Member("corrective_position", 60, "uint"),
                    new Member("corrective_position_width", 64, "uint"),
                    new Member("corrective_position_step", 68, "uint"),
                    new Member("weights", 72, "uint"),
                    new Member("features", 76, "uint"),
                },
                new Contract
                {
                    Rows = "count",
                    Most =
                    {
                        ["count"] = 4194240,
                        ["vertices"] = 16777216,
                    },
                    Fits = new[] { new[] { "first+count", "vertices" } },
                    Pose =
                    {
                        ["weights"] = "weights",
                        ["features"] = "features",
                    },
                    Same =
                    {
                        ["Mesh"] = new[] { "vertices" },
                    },
                    Elements =
                    {
                        ["Mesh"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*vertices",
                            },
                        },
                    },
                    Sections =
                    {
                        ["template_position"] = new SectionContract
                        {
                            Buffer = "MorphStatic",
                            Kind = "linear",
                            Elements = "3*count",
                            Width = "template_position_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "template_position_scale",
                            Floats = "2*3",
                        },
                        ["morph_ptr"] = new SectionContract
                        {
                            Buffer = "MorphStatic",
                            Kind = "pointer",
                            Elements = "count+1",
                            Pointer = 65536,
                        },
                        ["morph_column"] = new SectionContract
                        {
                            Buffer = "MorphStatic",
                            Kind = "index",
                            Elements = "#morph_ptr",
                            Width = "morph_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#weights",
                        },
                        ["morph_position"] = new SectionContract
                        {
                            Buffer = "MorphStatic",
                            Kind = "signed",
                            Elements = "3*#morph_ptr",
                            Width = "morph_position_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "morph_position_step",
                            Floats = "3*#weights",
                        },
                        ["corrective_ptr"] = new SectionContract
                        {
                            Buffer = "MorphStatic",
                            Kind = "pointer",
                            Elements = "count+1",
                            Pointer = 65536,
                        },
                        ["corrective_column"] = new SectionContract
                        {
                            Buffer = "MorphStatic",
                            Kind = "index",
                            Elements = "#corrective_ptr",
                            Width = "corrective_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#features",
                        },
                        ["corrective_position"] = new SectionContract
                        {
                            Buffer = "MorphStatic",
                            Kind = "signed",
                            Elements = "3*#corrective_ptr",
                            Width = "corrective_position_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "corrective_position_step",
                            Floats = "3*#features",
                        },
                    },
                }),
            ["skin"] = new Interface(
                "skin",
                64,
                new[]
                {
                    new StorageBuffer("SkinStatic", 4, true),
                    new StorageBuffer("Pose", 4, true),
                    new StorageBuffer("Mesh", 16, false),
                },
                new[]
                {
                    new Member("first", 0, "uint"),
                    new Member("count", 4, "uint"),
                    new Member("late_ptr", 8, "uint"),
                    new Member("late_column", 12, "uint"),
                    new Member("late_column_width", 16, "uint"),
                    new Member("late_position", 20, "uint"),
                    new Member("late_position_width", 24, "uint"),
                    new Member("late_position_step", 28, "uint"),
                    new Member("skin_ptr", 32, "uint"),
                    new Member("skin_column", 36, "uint"),
                    new Member("skin_column_width", 40, "uint"),
                    new Member("skin_weight", 44, "uint"),
                    new Member("skin_weight_width", 48, "uint"),
                    new Member("skin_weight_step", 52, "uint"),
                    new Member("late", 56, "uint"),
                    new Member("joints", 60, "uint"),
                },
                new Contract
                {
                    Rows = "count",
                    Most =
                    {
                        ["count"] = 4194240,
                    },
                    Pose =
                    {
                        ["late"] = "late",
                        ["joints"] = "joints",
                    },
                    Elements =
                    {
                        ["Mesh"] = new[]
                        {
                            new Touched
                            {
                                Elements = "first+count",
                            },
                        },
                    },
                    Sections =
                    {
                        ["late_ptr"] = new SectionContract
                        {
                            Buffer = "SkinStatic",
                            Kind = "pointer",
                            Elements = "count+1",
                            Pointer = 65536,
                        },
                        ["late_column"] = new SectionContract
                        {
                            Buffer = "SkinStatic",
                            Kind = "index",
                            Elements = "#late_ptr",
                            Width = "late_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#late",
                        },
                        ["late_position"] = new SectionContract
                        {
                            Buffer = "SkinStatic",
                            Kind = "signed",
                            Elements = "3*#late_ptr",
                            Width = "late_position_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "late_position_step",
                            Floats = "3*#late",
                        },
                        ["skin_ptr"] = new SectionContract
                        {
                            Buffer = "SkinStatic",
                            Kind = "pointer",
                            Elements = "count+1",
                            Pointer = 65536,
                        },
                        ["skin_column"] = new SectionContract
                        {
                            Buffer = "SkinStatic",
                            Kind = "index",
                            Elements = "#skin_ptr",
                            Width = "skin_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#joints",
                        },
                        ["skin_weight"] = new SectionContract
                        {
                            Buffer = "SkinStatic",
                            Kind = "weight",
                            Elements = "#skin_ptr",
                            Width = "skin_weight_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "skin_weight_step",
                            Floats = "1",
                        },
                    },
                }),
            ["blend"] = new Interface(
                "blend",
                64,
                new[]
                {
                    new StorageBuffer("BlendStatic", 4, true),
                    new StorageBuffer("Pose", 4, true),
                    new StorageBuffer("Splats", 16, false),
                    new StorageBuffer("Sh", 4, false),
                },
                new[]
                {
                    new Member("count", 0, "uint"),
                    new Member("sh_terms", 4, "uint"),
                    new Member("weights", 8, "uint"),
                    new Member("base_mean", 12, "uint"),
                    new Member("base_mean_width", 16, "uint"),
                    new Member("base_mean_scale", 20, "uint"),
                    new Member("base_log_scale", 24, "uint"),
                    new Member("base_log_scale_width", 28, "uint"),
                    new Member("base_log_scale_scale", 32, "uint"),
                    new Member("base_quat", 36, "uint"),
                    new Member("base_quat_width", 40, "uint"),
                    new Member("base_quat_scale", 44, "uint"),
                    new Member("base_opacity", 48, "uint"),
                    new Member("base_opacity_width", 52, "uint"),
                    new Member("base_opacity_table", 56, "uint"),
                    new Member("base_sh", 60, "uint"),
                    new Member("base_sh_width", 64, "uint"),
                    new Member("base_sh_scale", 68, "uint"),
                    new Member("geometry_ptr", 72, "uint"),
                    new Member("geometry_column", 76, "uint"),
                    new Member("geometry_column_width", 80, "uint"),
                    new Member("geometry_mean", 84, "uint"),
                    new Member("geometry_mean_width", 88, "uint"),
                    new Member("geometry_mean_step", 92, "uint"),
                    new Member("geometry_quat", 96, "uint"),
                    new Member("geometry_quat_width", 100, "uint"),
                    new Member("geometry_quat_step", 104, "uint"),
                    new Member("appearance_ptr", 108, "uint"),
                    new Member("appearance_column", 112, "uint"),
                    new Member("appearance_column_width", 116, "uint"),
                    new Member("appearance_log_scale", 120, "uint"),
                    new Member("appearance_log_scale_width", 124, "uint"),
                    new Member("appearance_log_scale_step", 128, "uint"),
                    new Member("appearance_opacity", 132, "uint"),
                    new Member("appearance_opacity_width", 136, "uint"),
                    new Member("appearance_opacity_step", 140, "uint"),
                    new Member("appearance_sh", 144, "uint"),
                    new Member("appearance_sh_width", 148, "uint"),
                    new Member("appearance_sh_step", 152, "uint"),
                    new Member("unused", 156, "uint"),
                },
                new Contract
                {
                    Rows = "count",
                    Most =
                    {
                        ["count"] = 4194240,
                    },
                    Chunk = "count",
                    Same =
                    {
                        ["Splats"] = new[] { "count" },
                        ["Sh"] = new[] { "count" },
                    },
                    Elements =
                    {
                        ["Splats"] = new[]
                        {
                            new Touched
                            {
                                Elements = "5*count",
                            },
                        },
                        ["Sh"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*sh_terms*count",
                            },
                        },
                    },
                    Values =
                    {
                        ["sh_terms"] = new[] { 1, 4, 9, 16 },
                    },
                    Pose =
                    {
                        ["weights"] = "weights",
                    },
                    Level = new[] { "sh_terms" },
                    Sections =
                    {
                        ["base_mean"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "linear",
                            Elements = "3*count",
                            Width = "base_mean_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_mean_scale",
                            Floats = "2*3",
                        },
                        ["base_log_scale"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "linear",
                            Elements = "3*count",
                            Width = "base_log_scale_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_log_scale_scale",
                            Floats = "2*3",
                        },
                        ["base_quat"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "linear",
                            Elements = "4*count",
                            Width = "base_quat_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_quat_scale",
                            Floats = "2*4",
                        },
                        ["base_opacity"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "table",
                            Elements = "count",
                            Width = "base_opacity_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_opacity_table",
                        },
                        ["base_sh"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "linear",
                            Elements = "3*sh_terms*count",
                            Width = "base_sh_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_sh_scale",
                            Floats = "2*3*sh_terms",
                        },
                        ["geometry_ptr"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "pointer",
                            Elements = "count+1",
                            Pointer = 65536,
                        },
                        ["geometry_column"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "index",
                            Elements = "#geometry_ptr",
                            Width = "geometry_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#weights",
                        },
                        ["geometry_mean"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "signed",
                            Elements = "3*#geometry_ptr",
                            Width = "geometry_mean_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "geometry_mean_step",
                            Floats = "3*#weights",
                        },
                        ["geometry_quat"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "signed",
                            Elements = "4*#geometry_ptr",
                            Width = "geometry_quat_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "geometry_quat_step",
                            Floats = "4*#weights",
                        },
                        ["appearance_ptr"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "pointer",
                            Elements = "count+1",
                            Pointer = 65536,
                        },
                        ["appearance_column"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "index",
                            Elements = "#appearance_ptr",
                            Width = "appearance_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#weights",
                        },
                        ["appearance_log_scale"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "signed",
                            Elements = "3*#appearance_ptr",
                            Width = "appearance_log_scale_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "appearance_log_scale_step",
                            Floats = "3*#weights",
                        },
                        ["appearance_opacity"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "signed",
                            Elements = "1*#appearance_ptr",
                            Width = "appearance_opacity_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "appearance_opacity_step",
                            Floats = "1*#weights",
                        },
                        ["appearance_sh"] = new SectionContract
                        {
                            Buffer = "BlendStatic",
                            Kind = "signed",
                            Elements = "3*sh_terms*#appearance_ptr",
                            Width = "appearance_sh_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "appearance_sh_step",
                            Floats = "3*sh_terms*#weights",
                        },
                    },
                }),
            ["bind_skin"] = new Interface(
                "bind",
                64,
                new[]
                {
                    new StorageBuffer("BindStatic", 4, true),
                    new StorageBuffer("Pose", 4, true),
                    new StorageBuffer("Splats", 16, false),
                },
                new[]
                {
                    new Member("count", 0, "uint"),
                    new Member("first", 4, "uint"),
                    new Member("rows", 8, "uint"),
                    new Member("corrective_ptr", 12, "uint"),
                    new Member("corrective_column", 16, "uint"),
                    new Member("corrective_column_width", 20, "uint"),
                    new Member("corrective_mean", 24, "uint"),
                    new Member("corrective_mean_width", 28, "uint"),
                    new Member("corrective_mean_step", 32, "uint"),
                    new Member("late_ptr", 36, "uint"),
                    new Member("late_column", 40, "uint"),
                    new Member("late_column_width", 44, "uint"),
                    new Member("late_mean", 48, "uint"),
                    new Member("late_mean_width", 52, "uint"),
                    new Member("late_mean_step", 56, "uint"),
                    new Member("skin_ptr", 60, "uint"),
                    new Member("skin_column", 64, "uint"),
                    new Member("skin_column_width", 68, "uint"),
                    new Member("skin_weight", 72, "uint"),
                    new Member("skin_weight_width", 76, "uint"),
                    new Member("skin_weight_step", 80, "uint"),
                    new Member("features", 84, "uint"),
                    new Member("late", 88, "uint"),
                    new Member("joints", 92, "uint"),
                    new Member("binding_rule", 96, "uint"),
                    new Member("rotation_rule", 100, "uint"),
                    new Member("sh_direction", 104, "uint"),
                    new Member("unused", 108, "uint"),
                    new Member("group_matrix_row0", 112, "float4"),
                    new Member("group_matrix_row1", 128, "float4"),
                    new Member("group_matrix_row2", 144, "float4"),
                    new Member("group_rotation_row0", 160, "float4"),
                    new Member("group_rotation_row1", 176, "float4"),
                    new Member("group_rotation_row2", 192, "float4"),
                    new Member("world_row0", 208, "float4"),
                    new Member("world_row1", 224, "float4"),
                    new Member("world_row2", 240, "float4"),
                    new Member("world_quat_wxyz", 256, "float4"),
                },
                new Contract
                {
                    Rows = "rows",
                    Most =
                    {
                        ["count"] = 4194240,
                        ["rows"] = 4194240,
                    },
                    Chunk = "count",
                    Same =
                    {
                        ["Splats"] = new[] { "count" },
                    },
                    Elements =
                    {
                        ["Splats"] = new[]
                        {
                            new Touched
                            {
                                Elements = "5*count",
                            },
                        },
                    },
                    Fits = new[] { new[] { "first+rows", "count" } },
                    Values =
                    {
                        ["binding_rule"] = new[] { 0, 1, 2, 3 },
                        ["rotation_rule"] = new[] { 4, 5, 6 },
                        ["sh_direction"] = new[] { 0, 1 },
                    },
                    Pose =
                    {
                        ["features"] = "features",
                        ["late"] = "late",
                        ["joints"] = "joints",
                    },
                    Sections =
                    {
                        ["corrective_ptr"] = new SectionContract
                        {
                            Buffer = "BindStatic",
                            Kind = "pointer",
                            Elements = "count+1",
                            Pointer = 65536,
                        },
                        ["corrective_column"] = new SectionContract
                        {
                            Buffer = "BindStatic",
                            Kind = "index",
                            Elements = "#corrective_ptr",
                            Width = "corrective_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#features",
                        },
                        ["corrective_mean"] = new SectionContract
                        {
                            Buffer = "BindStatic",
                            Kind = "signed",
                            Elements = "3*#corrective_ptr",
                            Width = "corrective_mean_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "corrective_mean_step",
                            Floats = "3*#features",
                        },
                        ["late_ptr"] = new SectionContract
                        {
                            Buffer = "BindStatic",
                            Kind = "pointer",
                            Elements = "count+1",
                            Pointer = 65536,
                        },
                        ["late_column"] = new SectionContract
                        {
                            Buffer = "BindStatic",
                            Kind = "index",
                            Elements = "#late_ptr",
                            Width = "late_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#late",
                        },
                        ["late_mean"] = new SectionContract
                        {
                            Buffer = "BindStatic",
                            Kind = "signed",
                            Elements = "3*#late_ptr",
                            Width = "late_mean_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "late_mean_step",
                            Floats = "3*#late",
                        },
                        ["skin_ptr"] = new SectionContract
                        {
                            Buffer = "BindStatic",
                            Kind = "pointer",
                            Elements = "count+1",
                            Pointer = 65536,
                        },
                        ["skin_column"] = new SectionContract
                        {
                            Buffer = "BindStatic",
                            Kind = "index",
                            Elements = "#skin_ptr",
                            Width = "skin_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#joints",
                        },
                        ["skin_weight"] = new SectionContract
                        {
                            Buffer = "BindStatic",
                            Kind = "weight",
                            Elements = "#skin_ptr",
                            Width = "skin_weight_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "skin_weight_step",
                            Floats = "1",
                        },
                    },
                }),
            ["bind_triangles"] = new Interface(
                "bind",
                64,
                new[]
                {
                    new StorageBuffer("SurfaceStatic", 4, true),
                    new StorageBuffer("Mesh", 16, true),
                    new StorageBuffer("Triangles", 16, false),
                },
                new[]
                {
                    new Member("triangles", 0, "uint"),
                    new Member("vertices", 4, "uint"),
                    new Member("corners", 8, "uint"),
                    new Member("corners_width", 12, "uint"),
                    new Member("canonical", 16, "uint"),
                    new Member("canonical_width", 20, "uint"),
                    new Member("canonical_scale", 24, "uint"),
                    new Member("rotation_rule", 28, "uint"),
                    new Member("quaternion_sign", 32, "uint"),
                },
                new Contract
                {
                    Rows = "triangles",
                    Most =
                    {
                        ["triangles"] = 4194240,
                        ["vertices"] = 16777216,
                    },
                    Values =
                    {
                        ["rotation_rule"] = new[] { 0, 1, 2, 3 },
                        ["quaternion_sign"] = new[] { 0, 1, 2 },
                    },
                    Same =
                    {
                        ["Mesh"] = new[] { "vertices" },
                        ["Triangles"] = new[] { "triangles", "vertices", "rotation_rule" },
                    },
                    Elements =
                    {
                        ["Mesh"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*vertices",
                            },
                        },
                        ["Triangles"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*triangles",
                            },
                        },
                    },
                    Sections =
                    {
                        ["corners"] = new SectionContract
                        {
                            Buffer = "SurfaceStatic",
                            Kind = "index",
                            Elements = "3*triangles",
                            Width = "corners_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "vertices",
                        },
                        ["canonical"] = new SectionContract
                        {
                            Buffer = "SurfaceStatic",
                            Kind = "linear",
                            Elements = "3*vertices",
                            Width = "canonical_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "canonical_scale",
                            Floats = "2*3",
                        },
                    },
                }),
            ["bind_vertices"] = new Interface(
                "bind",
                64,
                new[]
                {
                    new StorageBuffer("SurfaceStatic", 4, true),
                    new StorageBuffer("Triangles", 16, true),
                    new StorageBuffer("Pose", 4, true),
                    new StorageBuffer("Mesh", 16, false),
                },
                new[]
                {
                    new Member("vertices", 0, "uint"),
                    new Member("triangles", 4, "uint"),
                    new Member("vertex_triangle_ptr", 8, "uint"),
                    new Member("vertex_triangle", 12, "uint"),
                    new Member("vertex_triangle_width", 16, "uint"),
                    new Member("normal_floor", 20, "float"),
                    new Member("quaternion_floor", 24, "float"),
                    new Member("rotation_rule", 28, "uint"),
                    new Member("skin_ptr", 32, "uint"),
                    new Member("skin_column", 36, "uint"),
                    new Member("skin_column_width", 40, "uint"),
                    new Member("skin_weight", 44, "uint"),
                    new Member("skin_weight_width", 48, "uint"),
                    new Member("skin_weight_step", 52, "uint"),
                    new Member("joints", 56, "uint"),
                },
                new Contract
                {
                    Rows = "vertices",
                    Most =
                    {
                        ["triangles"] = 4194240,
                        ["vertices"] = 4194240,
                    },
                    Values =
                    {
                        ["rotation_rule"] = new[] { 0, 1, 2, 3 },
                    },
                    Pose =
                    {
                        ["joints"] = "joints",
                    },
                    Same =
                    {
                        ["Mesh"] = new[] { "vertices" },
                        ["Triangles"] = new[] { "triangles", "vertices", "rotation_rule" },
                    },
                    Elements =
                    {
                        ["Mesh"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*vertices",
                                When =
                                {
                                    ["rotation_rule"] = new[] { 0, 1, 2 },
                                },
                            },
                            new Touched
                            {
                                Elements = "5*vertices",
                                When =
                                {
                                    ["rotation_rule"] = new[] { 3 },
                                },
                            },
                        },
                        ["Triangles"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*triangles",
                            },
                        },
                    },
                    Sections =
                    {
                        ["vertex_triangle_ptr"] = new SectionContract
                        {
                            Buffer = "SurfaceStatic",
                            Kind = "pointer",
                            Elements = "vertices+1",
                            Pointer = 65536,
                        },
                        ["vertex_triangle"] = new SectionContract
                        {
                            Buffer = "SurfaceStatic",
                            Kind = "index",
                            Elements = "#vertex_triangle_ptr",
                            Width = "vertex_triangle_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "triangles",
                        },
                        ["skin_ptr"] = new SectionContract
                        {
                            Buffer = "SurfaceStatic",
                            Kind = "pointer",
                            Elements = "vertices+1",
                            Pointer = 65536,
                        },
                        ["skin_column"] = new SectionContract
                        {
                            Buffer = "SurfaceStatic",
                            Kind = "index",
                            Elements = "#skin_ptr",
                            Width = "skin_column_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "#joints",
                        },
                        ["skin_weight"] = new SectionContract
                        {
                            Buffer = "SurfaceStatic",
                            Kind = "weight",
                            Elements = "#skin_ptr",
                            Width = "skin_weight_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "skin_weight_step",
                            Floats = "1",
                        },
                    },
                }),
            ["bind_surface"] = new Interface(
                "bind",
                64,
                new[]
                {
                    new StorageBuffer("EmbedStatic", 4, true),
                    new StorageBuffer("Mesh", 16, true),
                    new StorageBuffer("Triangles", 16, true),
                    new StorageBuffer("Splats", 16, false),
                },
                new[]
                {
                    new Member("count", 0, "uint"),
                    new Member("vertices", 4, "uint"),
                    new Member("triangles", 8, "uint"),
                    new Member("triangle_ids", 12, "uint"),
                    new Member("triangle_ids_width", 16, "uint"),
                    new Member("barycentric", 20, "uint"),
                    new Member("barycentric_width", 24, "uint"),
                    new Member("barycentric_scale", 28, "uint"),
                    new Member("displacement", 32, "uint"),
                    new Member("displacement_width", 36, "uint"),
                    new Member("displacement_scale", 40, "uint"),
                    new Member("local_offset", 44, "uint"),
                    new Member("local_offset_width", 48, "uint"),
                    new Member("local_offset_scale", 52, "uint"),
                    new Member("local_quat", 56, "uint"),
                    new Member("local_quat_width", 60, "uint"),
                    new Member("local_quat_scale", 64, "uint"),
                    new Member("position_rule", 68, "uint"),
                    new Member("rotation_rule", 72, "uint"),
                    new Member("scale_rule", 76, "uint"),
                    new Member("sh_direction", 80, "uint"),
                    new Member("unused", 84, "uint"),
                    new Member("area_damping", 88, "float"),
                    new Member("log_training_per_bundle", 92, "float"),
                    new Member("world_row0", 96, "float4"),
                    new Member("world_row1", 112, "float4"),
                    new Member("world_row2", 128, "float4"),
                    new Member("world_quat_wxyz", 144, "float4"),
                },
                new Contract
                {
                    Rows = "count",
                    Most =
                    {
                        ["count"] = 4194240,
                        ["triangles"] = 4194240,
                        ["vertices"] = 16777216,
                    },
                    Chunk = "count",
                    Same =
                    {
                        ["Splats"] = new[] { "count" },
                        ["Mesh"] = new[] { "vertices" },
                        ["Triangles"] = new[] { "triangles", "vertices", "rotation_rule" },
                    },
                    Elements =
                    {
                        ["Mesh"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*vertices",
                                When =
                                {
                                    ["rotation_rule"] = new[] { 0, 1, 2 },
                                },
                            },
                            new Touched
                            {
                                Elements = "5*vertices",
                                When =
                                {
                                    ["rotation_rule"] = new[] { 3 },
                                },
                            },
                        },
                        ["Triangles"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*triangles",
                            },
                        },
                        ["Splats"] = new[]
                        {
                            new Touched
                            {
                                Elements = "5*count",
                            },
                        },
                    },
                    Values =
                    {
                        ["position_rule"] = new[] { 0, 1, 2 },
                        ["rotation_rule"] = new[] { 0, 1, 2, 3 },
                        ["scale_rule"] = new[] { 0, 1, 2 },
                        ["sh_direction"] = new[] { 0, 1 },
                    },
                    Sections =
                    {
                        ["triangle_ids"] = new SectionContract
                        {
                            Buffer = "EmbedStatic",
                            Kind = "index",
                            Elements = "count",
                            Width = "triangle_ids_width",
                            Widths = new[] { 8, 16, 32 },
                            Below = "triangles",
                        },
                        ["barycentric"] = new SectionContract
                        {
                            Buffer = "EmbedStatic",
                            Kind = "linear",
                            Elements = "3*count",
                            Width = "barycentric_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "barycentric_scale",
                            Floats = "2*3",
                        },
                        ["displacement"] = new SectionContract
                        {
                            Buffer = "EmbedStatic",
                            Kind = "linear",
                            Elements = "1*count",
                            Width = "displacement_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "displacement_scale",
                            Floats = "2*1",
                            When =
                            {
                                ["position_rule"] = new[] { 0, 2 },
                            },
                        },
                        ["local_offset"] = new SectionContract
                        {
                            Buffer = "EmbedStatic",
                            Kind = "linear",
                            Elements = "3*count",
                            Width = "local_offset_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "local_offset_scale",
                            Floats = "2*3",
                            When =
                            {
                                ["position_rule"] = new[] { 1 },
                            },
                        },
                        ["local_quat"] = new SectionContract
                        {
                            Buffer = "EmbedStatic",
                            Kind = "linear",
                            Elements = "4*count",
                            Width = "local_quat_width",
                            Widths = new[] { 0, 8, 16, 32 },
                            Scale = "local_quat_scale",
                            Floats = "2*4",
                        },
                    },
                }),
            ["activate"] = new Interface(
                "activate",
                64,
                new[]
                {
                    new StorageBuffer("Splats", 16, false),
                },
                new[]
                {
                    new Member("count", 0, "uint"),
                },
                new Contract
                {
                    Rows = "count",
                    Most =
                    {
                        ["count"] = 4194240,
                    },
                    Chunk = "count",
                    Same =
                    {
                        ["Splats"] = new[] { "count" },
                    },
                    Elements =
                    {
                        ["Splats"] = new[]
                        {
                            new Touched
                            {
                                Elements = "5*count",
                            },
                        },
                    },
                }),
            ["project"] = new Interface(
                "project",
                64,
                new[]
                {
                    new StorageBuffer("Splats", 16, true),
                    new StorageBuffer("Sh", 4, true),
                    new StorageBuffer("Projected", 16, false),
                },
                new[]
                {
                    new Member("count", 0, "uint"),
                    new Member("sh_degree", 4, "uint"),
                    new Member("near_z", 8, "float"),
                    new Member("low_pass", 12, "float"),
                    new Member("camera_row0", 16, "float4"),
                    new Member("camera_row1", 32, "float4"),
                    new Member("camera_row2", 48, "float4"),
                    new Member("clip_row0", 64, "float4"),
                    new Member("clip_row1", 80, "float4"),
                    new Member("clip_row2", 96, "float4"),
                    new Member("clip_row3", 112, "float4"),
                    new Member("eye", 128, "float4"),
                    new Member("tan_half_fov", 144, "float2"),
                    new Member("image_size", 152, "float2"),
                },
                new Contract
                {
                    Rows = "count",
                    Most =
                    {
                        ["count"] = 4194240,
                    },
                    Chunk = "count",
                    Same =
                    {
                        ["Splats"] = new[] { "count" },
                        ["Projected"] = new[] { "count" },
                        ["Sh"] = new[] { "count" },
                    },
                    Elements =
                    {
                        ["Splats"] = new[]
                        {
                            new Touched
                            {
                                Elements = "5*count",
                            },
                        },
                        ["Projected"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*count",
                            },
                        },
                        ["Sh"] = new[]
                        {
                            new Touched
                            {
                                Elements = "3*count",
                                When =
                                {
                                    ["sh_degree"] = new[] { 0 },
                                },
                            },
                            new Touched
                            {
                                Elements = "12*count",
                                When =
                                {
                                    ["sh_degree"] = new[] { 1 },
                                },
                            },
                            new Touched
                            {
                                Elements = "27*count",
                                When =
                                {
                                    ["sh_degree"] = new[] { 2 },
                                },
                            },
                            new Touched
                            {
                                Elements = "48*count",
                                When =
                                {
                                    ["sh_degree"] = new[] { 3 },
                                },
                            },
                        },
                    },
                    Values =
                    {
                        ["sh_degree"] = new[] { 0, 1, 2, 3 },
                    },
                }),
            ["sort_keys"] = new Interface(
                "sort",
                64,
                new[]
                {
                    new StorageBuffer("Projected", 16, true),
                    new StorageBuffer("Pairs", 8, false),
                },
                new[]
                {
                    new Member("count", 0, "uint"),
                    new Member("first", 4, "uint"),
                },
                null),
            ["sort_count"] = new Interface(
                "sort",
                64,
                new[]
                {
                    new StorageBuffer("Pairs", 8, true),
                    new StorageBuffer("Counts", 4, false),
                },
                new[]
                {
                    new Member("count", 0, "uint"),
                    new Member("groups", 4, "uint"),
                    new Member("shift", 8, "uint"),
                },
                null),
            ["sort_scan"] = new Interface(
                "sort",
                128,
                new[]
                {
                    new StorageBuffer("Counts", 4, false),
                },
                new[]
                {
                    new Member("total", 0, "uint"),
                },
                null),
            ["sort_scatter"] = new Interface(
                "sort",
                64,
                new[]
                {
                    new StorageBuffer("Pairs", 8, true),
                    new StorageBuffer("Counts", 4, true),
                    new StorageBuffer("PairsOut", 8, false),
                },
                new[]
                {
                    new Member("count", 0, "uint"),
                    new Member("groups", 4, "uint"),
                    new Member("shift", 8, "uint"),
                },
                null),
            ["raster_gather"] = new Interface(
                "raster",
                64,
                new[]
                {
                    new StorageBuffer("Projected", 16, true),
                    new StorageBuffer("Pairs", 8, true),
                    new StorageBuffer("Quads", 16, false),
                },
                new[]
                {
                    new Member("count", 0, "uint"),
                    new Member("begin", 4, "uint"),
                    new Member("piece_count", 8, "uint"),
                    new Member("first", 12, "uint"),
                    new Member("chunk_count", 16, "uint"),
                    new Member("reverse", 20, "uint"),
                },
                null),
        };
    }
}
