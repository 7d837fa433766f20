#include "lib/targets/target_field.h"
