#include "lib/camera/camera_file.h"
