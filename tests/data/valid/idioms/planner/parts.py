from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Iterator
from functools import cache

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan

Cell = tuple[int, int]


@cache
def _walls(*specs: str) -> frozenset[Cell]:
    cells: set[Cell] = set()
    for spec in specs:
        (x0, y0), (x1, y1) = (map(int, end.split(',')) for end in spec.split('-'))
        cells.update((x, y) for x in range(x0, x1 + 1) for y in range(y0, y1 + 1))
    return frozenset(cells)


def _neighbours(cell: Cell, size: int, walls: Iterable[Cell]) -> Iterator[Cell]:
    x, y = cell
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        if 0 <= (nx := x + dx) < size and 0 <= (ny := y + dy) < size and (nx, ny) not in walls:
            yield nx, ny


def _search(start: Cell, goal: Cell, size: int, walls: frozenset[Cell]) -> list[Cell]:
    came: dict[Cell, Cell | None] = {start: None}
    cost, heap = {start: 0}, [(0.0, start)]
    while heap:
        _, cell = heapq.heappop(heap)
        if cell == goal:
            break
        for n in _neighbours(cell, size, walls):
            if (new := cost[cell] + 1) < cost.get(n, math.inf):
                cost[n], came[n] = new, cell
                heapq.heappush(heap, (new + math.dist(n, goal), n))
    else:
        return []
    path = [cell]
    while (cell := came[cell]) is not None:
        path.append(cell)
    return path[::-1]


def make_plan(node, request: GetPlan.Request) -> GetPlan.Response:
    start, goal = ((round(p.pose.position.x), round(p.pose.position.y)) for p in (request.start, request.goal))
    response = GetPlan.Response()
    response.plan.header = request.start.header
    for x, y in _search(start, goal, node.parameters.size, _walls(*node.parameters.walls)):
        pose = PoseStamped(header=request.start.header)
        pose.pose.position.x, pose.pose.position.y = float(x), float(y)
        response.plan.poses.append(pose)
    return response


def ask(node) -> Path | None:
    request = GetPlan.Request(tolerance=0.5)
    request.goal.pose.position.x = request.goal.pose.position.y = 11.0
    plan = node.call('plan', request).plan
    return plan if plan.poses else None


def measure(node, path: Path) -> float:
    points = [p.pose.position for p in path.poses]
    return sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in zip(points, points[1:]))
