// The search for overlapping boxes, behind kernels.cl, whose macros it uses. It finds the pairs of
// src/collision/broad_phase.cpp: the same leaves, boxes narrowed to float by a monotone function, the last tests in
// double, of boxes and of the points of contact of balls. A work item serves a leaf and finds its partners among the leaves behind it. Pairs are counted, then written
// where the counts before them say. So none is dropped, and their order depends on no work group.
//
// The tree: leaf k is child k % 8 of node k / 8 of level 0, that node is child of node k / 64 of level 1, and so on.
// A node is 56 floats: lower x, y, z, upper x, y, z of its eight children, and whether a box of the child moves. Level l begins at node first[l]; level `top`
// is one node.

#define WIDTH 8u
#define NODE 56u
#define NO_BOX 0xffffffffu
// Coordinates are clamped to MOST. A gap begins beyond it and ends before it, so that it meets nothing.
#define MOST 1e38
#define NOWHERE 3e38f

#define TREE GLOBAL const uint* order, GLOBAL const double* boxes, GLOBAL const double* balls, \
             GLOBAL const double* travels, GLOBAL const unsigned char* fixed_boxes, GLOBAL float* nodes, \
             GLOBAL const uint* first, uint top, uint leaves
#define TREE_ARGUMENTS order, boxes, balls, travels, fixed_boxes, nodes, first, top, leaves

DEVICE float narrow(double x, double origin) {
  const double y = x - origin;
  return (float)(y < -MOST ? -MOST : y > MOST ? MOST : y);
}

DEVICE GLOBAL float* child_of(GLOBAL float* nodes, uint begin, uint k) {
  return nodes + NODE * (begin + k / WIDTH) + k % WIDTH;
}

// The boxes of balls that move along their travels, those of others meanwhile without meaning.
KERNEL boxes_of_balls(GLOBAL const double* balls, GLOBAL const double* travels, uint count, GLOBAL double* boxes) {
  FOR_TILE(i) {
    const uint ball = GROUP * TILE + i;
    if (ball < count) {
      const double radius = balls[4u * ball + 3u];
      for (uint axis = 0u; axis < 3u; ++axis) {
        const double at = balls[4u * ball + axis], travel = travels[3u * ball + axis];
        boxes[6u * ball + axis] = at - radius + (travel < 0.0 ? travel : 0.0);
        boxes[6u * ball + 3u + axis] = at + radius + (travel > 0.0 ? travel : 0.0);
      }
    }
  }
}

// The boxes `which`, six numbers each, which have no ball.
KERNEL put_boxes(GLOBAL const uint* which, GLOBAL const double* given, uint count, GLOBAL double* boxes) {
  FOR_TILE(i) {
    const uint k = GROUP * TILE + i;
    if (k < count)
      for (uint row = 0u; row < 6u; ++row) boxes[6u * which[k] + row] = given[6u * k + row];
  }
}

// The leaves: level 0.
KERNEL fit_leaves(TREE, double origin_x, double origin_y, double origin_z) {
  FOR_TILE(i) {
    const uint leaf = GROUP * TILE + i;
    if (leaf < leaves) {
      const double origin[3] = {origin_x, origin_y, origin_z};
      const uint box = order[leaf];
      GLOBAL float* child = child_of(nodes, 0u, leaf);
      child[6u * WIDTH] = box == NO_BOX || fixed_boxes[box] ? 0.0f : 1.0f;
      for (uint axis = 0u; axis < 3u; ++axis) {
        child[axis * WIDTH] = box == NO_BOX ? NOWHERE : narrow(boxes[6u * box + axis], origin[axis]);
        child[(axis + 3u) * WIDTH] = box == NO_BOX ? -NOWHERE : narrow(boxes[6u * box + 3u + axis], origin[axis]);
      }
    }
  }
}

// The children of a level from the `count` nodes of the level below, which begin at node `from`; gaps fill the last node.
KERNEL fit_nodes(GLOBAL float* nodes, uint from, uint count, uint to) {
  FOR_TILE(i) {
    const uint k = GROUP * TILE + i;
    if (k / WIDTH <= (count - 1u) / WIDTH) {
      GLOBAL float* child = child_of(nodes, to, k);
      for (uint row = 0u; row < 7u; ++row) {
        float bound = row < 3u ? NOWHERE : -NOWHERE;
        for (uint c = 0u; k < count && c < WIDTH; ++c) {
          const float other = nodes[NODE * (from + k) + row * WIDTH + c];
          if (row < 3u ? other < bound : other > bound) bound = other;
        }
        child[row * WIDTH] = bound;
      }
    }
  }
}

DEVICE uint meets(GLOBAL const float* child, const float* box) {
  uint in = 1u;
  for (uint axis = 0u; axis < 3u; ++axis)
    in = in && child[axis * WIDTH] <= box[axis + 3u] && child[(axis + 3u) * WIDTH] >= box[axis];
  return in;
}

DEVICE uint overlap(GLOBAL const double* a, GLOBAL const double* b) {
  return a[0] <= b[3] && b[0] <= a[3] && a[1] <= b[4] && b[1] <= a[4] && a[2] <= b[5] && b[2] <= a[5];
}

// Four numbers of a ball: centre, radius. Three of its travel. Operation by operation as in C++.
DEVICE uint may_touch(GLOBAL const double* a, GLOBAL const double* travel_a, GLOBAL const double* b,
                      GLOBAL const double* travel_b) {
  const V3 apart = v3(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  const double closing = dot3(apart, v3(travel_a[0] - travel_b[0], travel_a[1] - travel_b[1], travel_a[2] - travel_b[2]));
  const double squared = dot3(apart, apart);
  return !(squared + (closing < 0.0 ? closing : 0.0) > (a[3] + b[3]) * sqrt(squared));
}

// The partners of a leaf behind it: their number. A fixed box meets only those that move. They are written where `pairs` is given. Goes through the tree in the
// order of its leaves: down where boxes meet, else on to the next child or the node behind its parent.
DEVICE uint find_later(TREE, uint leaf, uint writes, GLOBAL uint* pairs, uint* visits) {
  const uint own = order[leaf];
  uint found = 0u, level = 0u, k = leaf, ended = own == NO_BOX;
  float box[6];
  for (uint row = 0u; row < 6u; ++row) box[row] = child_of(nodes, 0u, leaf)[row * WIDTH];
  uint down = 0u;
  const uint moves = !ended && !fixed_boxes[own];
  while (!ended) {
    if (down) {
      --level;
      k *= WIDTH;
    } else {
      ++k;
      while (level < top && k % WIDTH == 0u) {
        k /= WIDTH;
        ++level;
      }
    }
    down = 0u;
    if (level == top && k == WIDTH) {
      ended = 1u;
    } else {
      ++*visits;
      GLOBAL const float* child = child_of(nodes, first[level], k);
      if ((moves || child[6u * WIDTH] > 0.0f) && meets(child, box)) {
        down = level > 0u;
        if (!down) {
          const uint other = order[k];
          if (overlap(boxes + 6u * own, boxes + 6u * other) &&
              may_touch(balls + 4u * own, travels + 3u * own, balls + 4u * other, travels + 3u * other)) {
            if (writes) {
              pairs[2u * found] = own < other ? own : other;
              pairs[2u * found + 1u] = own < other ? other : own;
            }
            ++found;
          }
        }
      }
    }
  }
  return found;
}

// The number of partners of every leaf, and per tile the sums of partners and of visits.
KERNEL count_pairs(TREE, GLOBAL uint* counts, GLOBAL double* sums) {
  LOCAL_ARRAY(t, 2u * TILE);
  FOR_TILE(i) {
    const uint leaf = GROUP * TILE + i;
    uint found = 0u, visits = 0u;
    if (leaf < leaves) {
      found = find_later(TREE_ARGUMENTS, leaf, 0u, counts, &visits);
      counts[leaf] = found;
    }
    t[i] = (double)found;
    t[TILE + i] = (double)visits;
  }
  sum_tile(t, 2u, sums, GROUP, GROUPS);
}

// begins: the number of pairs before each tile.
KERNEL write_pairs(TREE, GLOBAL const uint* counts, GLOBAL const double* begins, GLOBAL uint* pairs) {
  FOR_TILE(i) {
    const uint leaf = GROUP * TILE + i;
    if (leaf < leaves) {
      uint begin = (uint)begins[GROUP], visits = 0u;
      for (uint before = GROUP * TILE; before < leaf; ++before) begin += counts[before];
      find_later(TREE_ARGUMENTS, leaf, 1u, pairs + 2u * begin, &visits);
    }
  }
}
