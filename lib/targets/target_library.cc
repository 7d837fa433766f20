#include "lib/targets/target_library.h"
