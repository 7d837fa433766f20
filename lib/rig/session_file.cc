#include "lib/rig/rig.h"
