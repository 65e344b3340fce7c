/* The light of a scene on an avatar. Rules of threads, errors, arguments and structs are those of avatar_player.h. */
#ifndef AVATAR_LIGHT_H
#define AVATAR_LIGHT_H

#include "avatar_player.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { AVATAR_MOST_LIGHTS = 4 };
/* A light from one direction, or from one point, in the scene's space (of avatar_place). */
typedef struct AvatarDirectLight {
    double place[3];  /* towards the light, of any length; of a point light where it is, metres */
    double colour[3]; /* linear: what a white matt surface reflects that faces it; of a point light from 1 m. 0 to 10000 */
    int32_t point;    /* 1: a point light */
} AvatarDirectLight;
/* All light of a scene. One colour from all sides is ambient[0] = colour / 0.28209479177387814. */
typedef struct AvatarLight {
    uint32_t struct_size AVATAR_SIZE(AvatarLight);
    uint32_t count;       /* of lights */
    int32_t shadow;       /* 1: the first light casts one */
    double ambient[9][3]; /* linear: what a white matt surface reflects, as SH of its normal in the scene; bases and signs are
                             those of the Gaussians' colours */
    AvatarDirectLight lights[AVATAR_MOST_LIGHTS];
} AvatarLight;
/* Shows the avatar in a light; NULL: in that of its capture, as trained. Fails for a pack that is not relit (AvatarFacts). The
 * light is copied. Avatars stand in it as avatar_update_pose and avatar_update_camera find them. Allocates nothing. */
AVATAR_API int avatar_set_light(AvatarInstance* instance, const AvatarLight* light);
/* What the light needs, after either update: no passes; those of AVATAR_LIGHT; those of AVATAR_SHADOW, too. */
enum { AVATAR_UNLIT = 0, AVATAR_LIT = 1, AVATAR_SHADOWED = 2 };
AVATAR_API int avatar_lighting(const AvatarInstance* instance);

/* Two more lists for avatar_passes_open, empty where a pack is not relit. Shadow passes follow deform, once a pose and light;
 * where one of them binds "Mesh", the passes of AVATAR_MESH have run. Light passes follow view, once a camera: they multiply
 * the colours of the projected splats, so view runs again before they do. */
enum { AVATAR_SHADOW = 3, AVATAR_LIGHT = 4 };

#ifdef __cplusplus
}
#endif

#endif
