// Codes of the values of rules. Generated from avatar_schema/v1/rules.json by `python -m avatar_shaders`; do not edit.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_RULES_HLSLI
#define AVATAR_RULES_HLSLI

// binding: what moves a group of Gaussians [schema/SPEC.md, section 7]
#define AVATAR_BINDING_SKIN 1
#define AVATAR_BINDING_ANCHOR 2
#define AVATAR_BINDING_JOINT_MIX 3
#define AVATAR_BINDING_SURFACE 4
#define AVATAR_BINDING_NONE 0
// rotation: how joints or mesh turn a Gaussian [schema/SPEC.md, section 7]
#define AVATAR_ROTATION_POLAR3 4
#define AVATAR_ROTATION_HEAD_BONE 5
#define AVATAR_ROTATION_NONE 6
#define AVATAR_ROTATION_VERTEX_QUATERNION 0
#define AVATAR_ROTATION_VERTEX_QUATERNION_MEAN 1
#define AVATAR_ROTATION_TRIANGLE_FRAME 2
#define AVATAR_ROTATION_BARY_VERTEX_LBS 3
// position: where a Gaussian sits on the posed mesh [schema/SPEC.md, section 7]
#define AVATAR_POSITION_NORMAL 0
#define AVATAR_POSITION_INTERPOLATED_NORMAL 2
#define AVATAR_POSITION_TRIANGLE_FRAME 1
// scale: what the posed mesh does to the log scale of a Gaussian [schema/SPEC.md, section 7]
#define AVATAR_SCALE_NONE 0
#define AVATAR_SCALE_LOG_AREA 1
#define AVATAR_SCALE_LINEAR_AREA 2
#define AVATAR_SCALE_TRIANGLE_LINEAR 2
// quaternion_sign: which of the two quaternions of a triangle's rotation is summed at its vertices [schema/SPEC.md, section 7]
#define AVATAR_QUATERNION_SIGN_W_POSITIVE 1
#define AVATAR_QUATERNION_SIGN_LARGEST_POSITIVE 0
#define AVATAR_QUATERNION_SIGN_LARGEST_POSITIVE_MIRRORED 2
// normal: the length of the normal of position rule normal [schema/SPEC.md, section 7]
#define AVATAR_NORMAL_UNIT 0
// sh_direction: the direction in which spherical harmonics are evaluated [schema/SPEC.md, section 7]
#define AVATAR_SH_DIRECTION_INVERSE_ROTATION 0
#define AVATAR_SH_DIRECTION_WORLD 1
// late_morphs: when late morphs are added [schema/SPEC.md, section 7]
#define AVATAR_LATE_MORPHS_AFTER_SKIN 0
// anchor: how often an anchor vertex counts in the rigid fit [schema/SPEC.md, section 7]
#define AVATAR_ANCHOR_REPEATS 0
#define AVATAR_ANCHOR_UNIQUE 1
// head_pose_in: what the trainer moved when the head turned [schema/SPEC.md, section 7]
#define AVATAR_HEAD_POSE_IN_CAMERA 0
#define AVATAR_HEAD_POSE_IN_MESH 1
// light_frame: what the light moved with in which the avatar was captured [schema/SPEC.md, section 19]
#define AVATAR_LIGHT_FRAME_HEAD 0
#define AVATAR_LIGHT_FRAME_WORLD 1
// background: what the avatar was trained before, where that is no single colour [schema/SPEC.md, section 5]
#define AVATAR_BACKGROUND_RANDOM 0
#define AVATAR_BACKGROUND_PER_VIEW 1
// driving_mode: how inputs become a pose [schema/SPEC.md, section 8]
#define AVATAR_DRIVING_MODE_NAMES 0
#define AVATAR_DRIVING_MODE_MATRIX 1
#define AVATAR_DRIVING_MODE_NONE 2

#endif
