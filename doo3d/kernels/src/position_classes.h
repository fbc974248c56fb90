// What a camera says about a position in space: the numbers of PointVisibility.
#pragma once

#include "arrays.h"

enum PositionClass : Index { OUTSIDE, NO_DEPTH, MASKED, SURFACE, HIDDEN, FREE, BARE };
