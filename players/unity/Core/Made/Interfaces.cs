// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>What the shaders bind.</summary>
    public static class Interfaces {
        /// <summary>Every compute entry of the shaders, by name.</summary>
        public static readonly Dictionary<string, Interface> All = new Dictionary<string, Interface> {
            ["morph"] = new Interface(
                "morph",
                new[] { new StorageBuffer("MorphStatic", 4, true), new StorageBuffer("Pose", 4, true),
                    new StorageBuffer("Mesh", 16, false) },
                "first count vertices template_position template_position_width template_position_scale " +
                "morph_ptr morph_column morph_column_width morph_position morph_position_width " +
                "morph_position_step corrective_ptr corrective_column corrective_column_width " +
                "corrective_position corrective_position_width corrective_position_step weights features",
                new Contract {
                    Rows = "count",
                    Most = { ["count"] = 4194240, ["vertices"] = 16777216 },
                    Fits = new[] { new[] { "first+count", "vertices" } },
                    Pose = { ["weights"] = "weights", ["features"] = "features" },
                    Same = { ["Mesh"] = new[] { "vertices" } },
                    Elements = { ["Mesh"] = new[] { new Touched { Elements = "3*vertices" } } },
                    Sections = {
                        ["template_position"] = new SectionContract { Buffer = "MorphStatic", Kind = "linear",
                            Elements = "3*count", Width = "template_position_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "template_position_scale", Floats = "2*3" },
                        ["morph_ptr"] = new SectionContract { Buffer = "MorphStatic", Kind = "pointer",
                            Elements = "count+1", Pointer = 65536 },
                        ["morph_column"] = new SectionContract { Buffer = "MorphStatic", Kind = "index",
                            Elements = "#morph_ptr", Width = "morph_column_width", Widths = new[] { 8, 16, 32 },
                            Below = "#weights" },
                        ["morph_position"] = new SectionContract { Buffer = "MorphStatic", Kind = "signed",
                            Elements = "3*#morph_ptr", Width = "morph_position_width",
                            Widths = new[] { 0, 8, 16, 32 }, Scale = "morph_position_step", Floats = "3*#weights" },
                        ["corrective_ptr"] = new SectionContract { Buffer = "MorphStatic", Kind = "pointer",
                            Elements = "count+1", Pointer = 65536 },
                        ["corrective_column"] = new SectionContract { Buffer = "MorphStatic", Kind = "index",
                            Elements = "#corrective_ptr", Width = "corrective_column_width",
                            Widths = new[] { 8, 16, 32 }, Below = "#features" },
                        ["corrective_position"] = new SectionContract { Buffer = "MorphStatic", Kind = "signed",
                            Elements = "3*#corrective_ptr", Width = "corrective_position_width",
                            Widths = new[] { 0, 8, 16, 32 }, Scale = "corrective_position_step",
                            Floats = "3*#features" },
                    },
                }),
            ["skin"] = new Interface(
                "skin",
                new[] { new StorageBuffer("SkinStatic", 4, true), new StorageBuffer("Pose", 4, true),
                    new StorageBuffer("Mesh", 16, false) },
                "first count late_ptr late_column late_column_width late_position late_position_width " +
                "late_position_step skin_ptr skin_column skin_column_width skin_weight skin_weight_width " +
                "skin_weight_step late joints",
                new Contract {
                    Rows = "count",
                    Most = { ["count"] = 4194240 },
                    Pose = { ["late"] = "late", ["joints"] = "joints" },
                    Elements = { ["Mesh"] = new[] { new Touched { Elements = "first+count" } } },
                    Sections = {
                        ["late_ptr"] = new SectionContract { Buffer = "SkinStatic", Kind = "pointer",
                            Elements = "count+1", Pointer = 65536 },
                        ["late_column"] = new SectionContract { Buffer = "SkinStatic", Kind = "index",
                            Elements = "#late_ptr", Width = "late_column_width", Widths = new[] { 8, 16, 32 },
                            Below = "#late" },
                        ["late_position"] = new SectionContract { Buffer = "SkinStatic", Kind = "signed",
                            Elements = "3*#late_ptr", Width = "late_position_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "late_position_step", Floats = "3*#late" },
                        ["skin_ptr"] = new SectionContract { Buffer = "SkinStatic", Kind = "pointer",
                            Elements = "count+1", Pointer = 65536 },
                        ["skin_column"] = new SectionContract { Buffer = "SkinStatic", Kind = "index",
                            Elements = "#skin_ptr", Width = "skin_column_width", Widths = new[] { 8, 16, 32 },
                            Below = "#joints" },
                        ["skin_weight"] = new SectionContract { Buffer = "SkinStatic", Kind = "weight",
                            Elements = "#skin_ptr", Width = "skin_weight_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "skin_weight_step", Floats = "1" },
                    },
                }),
            ["blend"] = new Interface(
                "blend",
                new[] { new StorageBuffer("BlendStatic", 4, true), new StorageBuffer("Pose", 4, true),
                    new StorageBuffer("Splats", 16, false), new StorageBuffer("Sh", 4, false) },
                "count sh_terms weights base_mean base_mean_width base_mean_scale base_log_scale " +
                "base_log_scale_width base_log_scale_scale base_quat base_quat_width base_quat_scale " +
                "base_opacity base_opacity_width base_opacity_table base_sh base_sh_width base_sh_scale " +
                "geometry_ptr geometry_column geometry_column_width geometry_mean geometry_mean_width " +
                "geometry_mean_step geometry_quat geometry_quat_width geometry_quat_step appearance_ptr " +
                "appearance_column appearance_column_width appearance_log_scale appearance_log_scale_width " +
                "appearance_log_scale_step appearance_opacity appearance_opacity_width appearance_opacity_step " +
                "appearance_sh appearance_sh_width appearance_sh_step unused",
                new Contract {
                    Rows = "count",
                    Most = { ["count"] = 4194240 },
                    Chunk = "count",
                    Same = { ["Splats"] = new[] { "count" }, ["Sh"] = new[] { "count" } },
                    Elements = { ["Splats"] = new[] { new Touched { Elements = "5*count" } },
                        ["Sh"] = new[] { new Touched { Elements = "3*sh_terms*count" } } },
                    Values = { ["sh_terms"] = new[] { 1, 4, 9, 16 } },
                    Pose = { ["weights"] = "weights" },
                    Level = new[] { "sh_terms" },
                    Sections = {
                        ["base_mean"] = new SectionContract { Buffer = "BlendStatic", Kind = "linear",
                            Elements = "3*count", Width = "base_mean_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_mean_scale", Floats = "2*3" },
                        ["base_log_scale"] = new SectionContract { Buffer = "BlendStatic", Kind = "linear",
                            Elements = "3*count", Width = "base_log_scale_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_log_scale_scale", Floats = "2*3" },
                        ["base_quat"] = new SectionContract { Buffer = "BlendStatic", Kind = "linear",
                            Elements = "4*count", Width = "base_quat_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_quat_scale", Floats = "2*4" },
                        ["base_opacity"] = new SectionContract { Buffer = "BlendStatic", Kind = "table",
                            Elements = "count", Width = "base_opacity_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_opacity_table" },
                        ["base_sh"] = new SectionContract { Buffer = "BlendStatic", Kind = "linear",
                            Elements = "3*sh_terms*count", Width = "base_sh_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "base_sh_scale", Floats = "2*3*sh_terms" },
                        ["geometry_ptr"] = new SectionContract { Buffer = "BlendStatic", Kind = "pointer",
                            Elements = "count+1", Pointer = 65536 },
                        ["geometry_column"] = new SectionContract { Buffer = "BlendStatic", Kind = "index",
                            Elements = "#geometry_ptr", Width = "geometry_column_width", Widths = new[] { 8, 16, 32 },
                            Below = "#weights" },
                        ["geometry_mean"] = new SectionContract { Buffer = "BlendStatic", Kind = "signed",
                            Elements = "3*#geometry_ptr", Width = "geometry_mean_width",
                            Widths = new[] { 0, 8, 16, 32 }, Scale = "geometry_mean_step", Floats = "3*#weights" },
                        ["geometry_quat"] = new SectionContract { Buffer = "BlendStatic", Kind = "signed",
                            Elements = "4*#geometry_ptr", Width = "geometry_quat_width",
                            Widths = new[] { 0, 8, 16, 32 }, Scale = "geometry_quat_step", Floats = "4*#weights" },
                        ["appearance_ptr"] = new SectionContract { Buffer = "BlendStatic", Kind = "pointer",
                            Elements = "count+1", Pointer = 65536 },
                        ["appearance_column"] = new SectionContract { Buffer = "BlendStatic", Kind = "index",
                            Elements = "#appearance_ptr", Width = "appearance_column_width",
                            Widths = new[] { 8, 16, 32 }, Below = "#weights" },
                        ["appearance_log_scale"] = new SectionContract { Buffer = "BlendStatic", Kind = "signed",
                            Elements = "3*#appearance_ptr", Width = "appearance_log_scale_width",
                            Widths = new[] { 0, 8, 16, 32 }, Scale = "appearance_log_scale_step",
                            Floats = "3*#weights" },
                        ["appearance_opacity"] = new SectionContract { Buffer = "BlendStatic", Kind = "signed",
                            Elements = "1*#appearance_ptr", Width = "appearance_opacity_width",
                            Widths = new[] { 0, 8, 16, 32 }, Scale = "appearance_opacity_step",
                            Floats = "1*#weights" },
                        ["appearance_sh"] = new SectionContract { Buffer = "BlendStatic", Kind = "signed",
                            Elements = "3*sh_terms*#appearance_ptr", Width = "appearance_sh_width",
                            Widths = new[] { 0, 8, 16, 32 }, Scale = "appearance_sh_step",
                            Floats = "3*sh_terms*#weights" },
                    },
                }),
            ["bind_skin"] = new Interface(
                "bind",
                new[] { new StorageBuffer("BindStatic", 4, true), new StorageBuffer("Pose", 4, true),
                    new StorageBuffer("Splats", 16, false) },
                "count first rows corrective_ptr corrective_column corrective_column_width corrective_mean " +
                "corrective_mean_width corrective_mean_step late_ptr late_column late_column_width late_mean " +
                "late_mean_width late_mean_step skin_ptr skin_column skin_column_width skin_weight " +
                "skin_weight_width skin_weight_step features late joints binding_rule rotation_rule " +
                "sh_direction unused group_matrix_row0:float4 group_matrix_row1:float4 group_matrix_row2:float4 " +
                "group_rotation_row0:float4 group_rotation_row1:float4 group_rotation_row2:float4 " +
                "world_row0:float4 world_row1:float4 world_row2:float4 world_quat_wxyz:float4",
                new Contract {
                    Rows = "rows",
                    Most = { ["count"] = 4194240, ["rows"] = 4194240 },
                    Chunk = "count",
                    Same = { ["Splats"] = new[] { "count" } },
                    Elements = { ["Splats"] = new[] { new Touched { Elements = "5*count" } } },
                    Fits = new[] { new[] { "first+rows", "count" } },
                    Values = { ["binding_rule"] = new[] { 0, 1, 2, 3 }, ["rotation_rule"] = new[] { 4, 5, 6 },
                        ["sh_direction"] = new[] { 0, 1 } },
                    Pose = { ["features"] = "features", ["late"] = "late", ["joints"] = "joints" },
                    Sections = {
                        ["corrective_ptr"] = new SectionContract { Buffer = "BindStatic", Kind = "pointer",
                            Elements = "count+1", Pointer = 65536 },
                        ["corrective_column"] = new SectionContract { Buffer = "BindStatic", Kind = "index",
                            Elements = "#corrective_ptr", Width = "corrective_column_width",
                            Widths = new[] { 8, 16, 32 }, Below = "#features" },
                        ["corrective_mean"] = new SectionContract { Buffer = "BindStatic", Kind = "signed",
                            Elements = "3*#corrective_ptr", Width = "corrective_mean_width",
                            Widths = new[] { 0, 8, 16, 32 }, Scale = "corrective_mean_step", Floats = "3*#features" },
                        ["late_ptr"] = new SectionContract { Buffer = "BindStatic", Kind = "pointer",
                            Elements = "count+1", Pointer = 65536 },
                        ["late_column"] = new SectionContract { Buffer = "BindStatic", Kind = "index",
                            Elements = "#late_ptr", Width = "late_column_width", Widths = new[] { 8, 16, 32 },
                            Below = "#late" },
                        ["late_mean"] = new SectionContract { Buffer = "BindStatic", Kind = "signed",
                            Elements = "3*#late_ptr", Width = "late_mean_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "late_mean_step", Floats = "3*#late" },
                        ["skin_ptr"] = new SectionContract { Buffer = "BindStatic", Kind = "pointer",
                            Elements = "count+1", Pointer = 65536 },
                        ["skin_column"] = new SectionContract { Buffer = "BindStatic", Kind = "index",
                            Elements = "#skin_ptr", Width = "skin_column_width", Widths = new[] { 8, 16, 32 },
                            Below = "#joints" },
                        ["skin_weight"] = new SectionContract { Buffer = "BindStatic", Kind = "weight",
                            Elements = "#skin_ptr", Width = "skin_weight_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "skin_weight_step", Floats = "1" },
                    },
                }),
            ["bind_triangles"] = new Interface(
                "bind",
                new[] { new StorageBuffer("SurfaceStatic", 4, true), new StorageBuffer("Mesh", 16, true),
                    new StorageBuffer("Triangles", 16, false) },
                "triangles vertices corners corners_width canonical canonical_width canonical_scale " +
                "rotation_rule quaternion_sign",
                new Contract {
                    Rows = "triangles",
                    Most = { ["triangles"] = 4194240, ["vertices"] = 16777216 },
                    Values = { ["rotation_rule"] = new[] { 0, 1, 2, 3 },
                        ["quaternion_sign"] = new[] { 0, 1, 2 } },
                    Same = { ["Mesh"] = new[] { "vertices" }, ["Triangles"] = new[] { "triangles", "vertices",
                        "rotation_rule" } },
                    Elements = { ["Mesh"] = new[] { new Touched { Elements = "3*vertices" } },
                        ["Triangles"] = new[] { new Touched { Elements = "3*triangles" } } },
                    Sections = {
                        ["corners"] = new SectionContract { Buffer = "SurfaceStatic", Kind = "index",
                            Elements = "3*triangles", Width = "corners_width", Widths = new[] { 8, 16, 32 },
                            Below = "vertices" },
                        ["canonical"] = new SectionContract { Buffer = "SurfaceStatic", Kind = "linear",
                            Elements = "3*vertices", Width = "canonical_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "canonical_scale", Floats = "2*3" },
                    },
                }),
            ["bind_vertices"] = new Interface(
                "bind",
                new[] { new StorageBuffer("SurfaceStatic", 4, true), new StorageBuffer("Triangles", 16, true),
                    new StorageBuffer("Pose", 4, true), new StorageBuffer("Mesh", 16, false) },
                "vertices triangles vertex_triangle_ptr vertex_triangle vertex_triangle_width " +
                "normal_floor:float quaternion_floor:float rotation_rule skin_ptr skin_column skin_column_width " +
                "skin_weight skin_weight_width skin_weight_step joints",
                new Contract {
                    Rows = "vertices",
                    Most = { ["triangles"] = 4194240, ["vertices"] = 4194240 },
                    Values = { ["rotation_rule"] = new[] { 0, 1, 2, 3 } },
                    Pose = { ["joints"] = "joints" },
                    Same = { ["Mesh"] = new[] { "vertices" }, ["Triangles"] = new[] { "triangles", "vertices",
                        "rotation_rule" } },
                    Elements = { ["Mesh"] = new[] { new Touched { Elements = "3*vertices",
                        When = { ["rotation_rule"] = new[] { 0, 1, 2 } } }, new Touched { Elements = "5*vertices",
                        When = { ["rotation_rule"] = new[] { 3 } } } },
                        ["Triangles"] = new[] { new Touched { Elements = "3*triangles" } } },
                    Sections = {
                        ["vertex_triangle_ptr"] = new SectionContract { Buffer = "SurfaceStatic", Kind = "pointer",
                            Elements = "vertices+1", Pointer = 65536 },
                        ["vertex_triangle"] = new SectionContract { Buffer = "SurfaceStatic", Kind = "index",
                            Elements = "#vertex_triangle_ptr", Width = "vertex_triangle_width",
                            Widths = new[] { 8, 16, 32 }, Below = "triangles" },
                        ["skin_ptr"] = new SectionContract { Buffer = "SurfaceStatic", Kind = "pointer",
                            Elements = "vertices+1", Pointer = 65536 },
                        ["skin_column"] = new SectionContract { Buffer = "SurfaceStatic", Kind = "index",
                            Elements = "#skin_ptr", Width = "skin_column_width", Widths = new[] { 8, 16, 32 },
                            Below = "#joints" },
                        ["skin_weight"] = new SectionContract { Buffer = "SurfaceStatic", Kind = "weight",
                            Elements = "#skin_ptr", Width = "skin_weight_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "skin_weight_step", Floats = "1" },
                    },
                }),
            ["bind_surface"] = new Interface(
                "bind",
                new[] { new StorageBuffer("EmbedStatic", 4, true), new StorageBuffer("Mesh", 16, true),
                    new StorageBuffer("Triangles", 16, true), new StorageBuffer("Splats", 16, false) },
                "count vertices triangles triangle_ids triangle_ids_width barycentric barycentric_width " +
                "barycentric_scale displacement displacement_width displacement_scale local_offset " +
                "local_offset_width local_offset_scale local_quat local_quat_width local_quat_scale " +
                "position_rule rotation_rule scale_rule sh_direction unused area_damping:float " +
                "log_training_per_bundle:float world_row0:float4 world_row1:float4 world_row2:float4 " +
                "world_quat_wxyz:float4",
                new Contract {
                    Rows = "count",
                    Most = { ["count"] = 4194240, ["triangles"] = 4194240, ["vertices"] = 16777216 },
                    Chunk = "count",
                    Same = { ["Splats"] = new[] { "count" }, ["Mesh"] = new[] { "vertices" },
                        ["Triangles"] = new[] { "triangles", "vertices", "rotation_rule" } },
                    Elements = { ["Mesh"] = new[] { new Touched { Elements = "3*vertices",
                        When = { ["rotation_rule"] = new[] { 0, 1, 2 } } }, new Touched { Elements = "5*vertices",
                        When = { ["rotation_rule"] = new[] { 3 } } } },
                        ["Triangles"] = new[] { new Touched { Elements = "3*triangles" } },
                        ["Splats"] = new[] { new Touched { Elements = "5*count" } } },
                    Values = { ["position_rule"] = new[] { 0, 1, 2 }, ["rotation_rule"] = new[] { 0, 1, 2, 3 },
                        ["scale_rule"] = new[] { 0, 1, 2 }, ["sh_direction"] = new[] { 0, 1 } },
                    Sections = {
                        ["triangle_ids"] = new SectionContract { Buffer = "EmbedStatic", Kind = "index",
                            Elements = "count", Width = "triangle_ids_width", Widths = new[] { 8, 16, 32 },
                            Below = "triangles" },
                        ["barycentric"] = new SectionContract { Buffer = "EmbedStatic", Kind = "linear",
                            Elements = "3*count", Width = "barycentric_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "barycentric_scale", Floats = "2*3" },
                        ["displacement"] = new SectionContract { Buffer = "EmbedStatic", Kind = "linear",
                            Elements = "1*count", Width = "displacement_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "displacement_scale", Floats = "2*1",
                            When = { ["position_rule"] = new[] { 0, 2 } } },
                        ["local_offset"] = new SectionContract { Buffer = "EmbedStatic", Kind = "linear",
                            Elements = "3*count", Width = "local_offset_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "local_offset_scale", Floats = "2*3",
                            When = { ["position_rule"] = new[] { 1 } } },
                        ["local_quat"] = new SectionContract { Buffer = "EmbedStatic", Kind = "linear",
                            Elements = "4*count", Width = "local_quat_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "local_quat_scale", Floats = "2*4" },
                    },
                }),
            ["activate"] = new Interface(
                "activate",
                new[] { new StorageBuffer("Splats", 16, false) },
                "count",
                new Contract {
                    Rows = "count",
                    Most = { ["count"] = 4194240 },
                    Chunk = "count",
                    Same = { ["Splats"] = new[] { "count" } },
                    Elements = { ["Splats"] = new[] { new Touched { Elements = "5*count" } } },
                }),
            ["project"] = new Interface(
                "project",
                new[] { new StorageBuffer("Splats", 16, true), new StorageBuffer("Sh", 4, true),
                    new StorageBuffer("Projected", 16, false) },
                "count sh_degree near_z:float low_pass:float camera_row0:float4 camera_row1:float4 " +
                "camera_row2:float4 clip_row0:float4 clip_row1:float4 clip_row2:float4 clip_row3:float4 " +
                "eye:float4 tan_half_fov:float2 image_size:float2",
                new Contract {
                    Rows = "count",
                    Most = { ["count"] = 4194240 },
                    Chunk = "count",
                    Same = { ["Splats"] = new[] { "count" }, ["Projected"] = new[] { "count" },
                        ["Sh"] = new[] { "count" } },
                    Elements = { ["Splats"] = new[] { new Touched { Elements = "5*count" } },
                        ["Projected"] = new[] { new Touched { Elements = "3*count" } },
                        ["Sh"] = new[] { new Touched { Elements = "3*count",
                        When = { ["sh_degree"] = new[] { 0 } } }, new Touched { Elements = "12*count",
                        When = { ["sh_degree"] = new[] { 1 } } }, new Touched { Elements = "27*count",
                        When = { ["sh_degree"] = new[] { 2 } } }, new Touched { Elements = "48*count",
                        When = { ["sh_degree"] = new[] { 3 } } } } },
                    Values = { ["sh_degree"] = new[] { 0, 1, 2, 3 } },
                }),
            ["shadow_clear"] = new Interface(
                "shadow",
                new[] { new StorageBuffer("Shadow", 4, false) },
                "texels",
                new Contract {
                    Rows = "texels",
                    Values = { ["texels"] = new[] { 65536 } },
                    Most = { ["texels"] = 4194240 },
                    Elements = { ["Shadow"] = new[] { new Touched { Elements = "65536" } } },
                }),
            ["shadow_mesh"] = new Interface(
                "shadow",
                new[] { new StorageBuffer("CornerStatic", 4, true), new StorageBuffer("Mesh", 16, true),
                    new StorageBuffer("Shadow", 4, false) },
                "triangles vertices corners corners_width world_row0:float4 world_row1:float4 world_row2:float4 " +
                "shadow_row0:float4 shadow_row1:float4 shadow_row2:float4 shadow_row3:float4",
                new Contract {
                    Rows = "triangles",
                    Most = { ["triangles"] = 4194240, ["vertices"] = 16777216 },
                    Same = { ["Mesh"] = new[] { "vertices" } },
                    Elements = { ["Mesh"] = new[] { new Touched { Elements = "vertices" } },
                        ["Shadow"] = new[] { new Touched { Elements = "65536" } } },
                    Sections = {
                        ["corners"] = new SectionContract { Buffer = "CornerStatic", Kind = "index",
                            Elements = "3*triangles", Width = "corners_width", Widths = new[] { 8, 16, 32 },
                            Below = "vertices" },
                    },
                }),
            ["shadow"] = new Interface(
                "shadow",
                new[] { new StorageBuffer("Splats", 16, true), new StorageBuffer("Shadow", 4, false) },
                "shadow_row0:float4 shadow_row1:float4 shadow_row2:float4 shadow_row3:float4 count",
                new Contract {
                    Rows = "count",
                    Most = { ["count"] = 4194240 },
                    Chunk = "count",
                    Same = { ["Splats"] = new[] { "count" } },
                    Elements = { ["Splats"] = new[] { new Touched { Elements = "5*count" } },
                        ["Shadow"] = new[] { new Touched { Elements = "65536" } } },
                }),
            ["light_normals"] = new Interface(
                "light",
                new[] { new StorageBuffer("EmbedStatic", 4, true), new StorageBuffer("LightStatic", 4, true),
                    new StorageBuffer("Triangles", 16, true), new StorageBuffer("Splats", 16, false) },
                "world_quat_wxyz:float4 count triangles triangle_ids triangle_ids_width local_quat " +
                "local_quat_width local_quat_scale normal normal_width normal_scale",
                new Contract {
                    Rows = "count",
                    Most = { ["count"] = 4194240, ["triangles"] = 4194240 },
                    Chunk = "count",
                    Same = { ["Splats"] = new[] { "count" }, ["Triangles"] = new[] { "triangles" } },
                    Elements = { ["Splats"] = new[] { new Touched { Elements = "6*count" } },
                        ["Triangles"] = new[] { new Touched { Elements = "3*triangles" } } },
                    Sections = {
                        ["triangle_ids"] = new SectionContract { Buffer = "EmbedStatic", Kind = "index",
                            Elements = "count", Width = "triangle_ids_width", Widths = new[] { 8, 16, 32 },
                            Below = "triangles" },
                        ["local_quat"] = new SectionContract { Buffer = "EmbedStatic", Kind = "linear",
                            Elements = "4*count", Width = "local_quat_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "local_quat_scale", Floats = "2*4" },
                        ["normal"] = new SectionContract { Buffer = "LightStatic", Kind = "linear",
                            Elements = "3*count", Width = "normal_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "normal_scale", Floats = "2*3" },
                    },
                }),
            ["light"] = new Interface(
                "light",
                new[] { new StorageBuffer("LightStatic", 4, true), new StorageBuffer("Splats", 16, true),
                    new StorageBuffer("Shadow", 4, true), new StorageBuffer("Projected", 16, false) },
                "count normal normal_width normal_scale turn_row0:float4 turn_row1:float4 turn_row2:float4 " +
                "capture_ambient0:float4 capture_ambient1:float4 capture_ambient2:float4 " +
                "capture_ambient3:float4 capture_ambient4:float4 capture_ambient5:float4 " +
                "capture_ambient6:float4 capture_ambient7:float4 capture_ambient8:float4 scene_ambient0:float4 " +
                "scene_ambient1:float4 scene_ambient2:float4 scene_ambient3:float4 scene_ambient4:float4 " +
                "scene_ambient5:float4 scene_ambient6:float4 scene_ambient7:float4 scene_ambient8:float4 " +
                "place0:float4 place1:float4 place2:float4 place3:float4 colour0:float4 colour1:float4 " +
                "colour2:float4 colour3:float4 shadow_row0:float4 shadow_row1:float4 shadow_row2:float4 " +
                "shadow_row3:float4 shadow_offset:float4 turned",
                new Contract {
                    Rows = "count",
                    Most = { ["count"] = 4194240 },
                    Chunk = "count",
                    Same = { ["Splats"] = new[] { "count" }, ["Projected"] = new[] { "count" } },
                    Elements = { ["Splats"] = new[] { new Touched { Elements = "5*count" },
                        new Touched { Elements = "6*count", When = { ["turned"] = new[] { 1 } } } },
                        ["Projected"] = new[] { new Touched { Elements = "3*count" } },
                        ["Shadow"] = new[] { new Touched { Elements = "65536" } } },
                    Values = { ["turned"] = new[] { 0, 1 } },
                    Sections = {
                        ["normal"] = new SectionContract { Buffer = "LightStatic", Kind = "linear",
                            Elements = "3*count", Width = "normal_width", Widths = new[] { 0, 8, 16, 32 },
                            Scale = "normal_scale", Floats = "2*3" },
                    },
                }),
            ["sort_keys"] = new Interface(
                "sort",
                new[] { new StorageBuffer("Projected", 16, true), new StorageBuffer("Pairs", 8, false) },
                "count first",
                null),
            ["sort_count"] = new Interface(
                "sort",
                new[] { new StorageBuffer("Pairs", 8, true), new StorageBuffer("Counts", 4, false) },
                "count groups shift",
                null),
            ["sort_scan"] = new Interface(
                "sort",
                new[] { new StorageBuffer("Counts", 4, false) },
                "total",
                null),
            ["sort_scatter"] = new Interface(
                "sort",
                new[] { new StorageBuffer("Pairs", 8, true), new StorageBuffer("Counts", 4, true),
                    new StorageBuffer("PairsOut", 8, false) },
                "count groups shift",
                null),
            ["raster_gather"] = new Interface(
                "raster",
                new[] { new StorageBuffer("Projected", 16, true), new StorageBuffer("Pairs", 8, true),
                    new StorageBuffer("Quads", 16, false) },
                "count begin piece_count first chunk_count reverse",
                null),
        };
    }
}
