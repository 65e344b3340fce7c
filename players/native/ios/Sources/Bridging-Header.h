#include "avatar_player.h"
