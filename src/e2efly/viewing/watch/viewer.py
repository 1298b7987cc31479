"""The page in the browser: a stage and its vehicles in viser's scene. Needs the extra `watch`."""

import contextlib
import io
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from e2efly.config.drawing import Face, Line, Mark
from e2efly.control.vectors import rotate
from e2efly.logs.scripts.origins import refusal
from e2efly.simulation.scenes.faces import FacesBody
from e2efly.viewing.watch.port import free_port
from e2efly.viewing.watch.stage import Stage, StageFrame
from e2efly.viewing.watch.triangles import (
    BEHIND,
    GOAL,
    GRID,
    GROUND,
    NOSE,
    SKY,
    SLOWEST,
    Mesh,
    face,
    mesh_of,
    quadrotor,
    rgb,
    spun,
)

Camera = Literal["follow", "orbit", "first person"]
CAMERAS: tuple[Camera, ...] = ("follow", "orbit", "first person")
"""Camera modes for the followed vehicle, in order: the camera moves with the vehicle and the mouse turns it around the
vehicle; the mouse sets the position of the camera; the camera looks from the vehicle's nose."""
TRAIL_POINTS = 120
"""Number of pieces in which the followed vehicle's path is shown, one per frame."""
MANY = 32
"""With more vehicles than this, only the goal of the followed vehicle is drawn."""
LOAD = 0.04
"""Radius of the ball that is drawn for a load, m."""
FAR_OFF = np.array([[0, 0, 3000], [0, 0, -3000]], np.float32)
"""Positions of two additional instances of each mesh, m. Without them, three.js would not draw a mesh whose first
positions are out of view."""
LEVEL = np.array([1, 0, 0, 0], np.float32)
ANCHOR = np.array([0.0, 0.0, 1.0])
"""Position of the followed vehicle in the space of the page."""
GHOST = (120, 140, 165)
"""RGB of the vehicles of a second flight, which is shown with the first."""


def serve(host: str, port: int, title: str) -> Any:
    """A viser server.

    Raises:
        ValueError: when viser is not installed, or when the port is in use.
        OSError: for an address that this machine does not have.
    """
    port = free_port(host, port)
    import viser

    with _checked(host), contextlib.redirect_stdout(io.StringIO()):  # it prints a box with its address
        server = viser.ViserServer(host, port, title, verbose=False)
    scene, first = server.scene, server.initial_camera
    scene.set_up_direction("+z")
    scene.configure_environment_map(None)
    scene.configure_default_lights(False)
    scene.add_light_hemisphere("/light/sky", ground_color=(150, 150, 155), intensity=1.6)
    scene.add_light_directional("/light/sun", intensity=1.6, position=(3.0, 2.0, 8.0))
    scene.set_background_image(np.full((2, 2, 3), _rgb(SKY), np.uint8), format="png")
    server.gui.main_panel.dock_right()
    first.position, first.look_at = tuple(ANCHOR + BEHIND), tuple(ANCHOR)
    return server


@contextlib.contextmanager
def _checked(host: str) -> Iterator[None]:
    """Have the server that viser starts within the block refuse what `refusal` refuses.

    viser leaves no room for a check of its requests, so the function that opens its server is replaced meanwhile.
    """
    from websockets.asyncio import server as opened

    serve, used = opened.serve, list[str]()

    def checked(*args: Any, process_request: Any, **options: Any) -> Any:
        def process(connection: Any, request: Any) -> Any:
            values = request.headers
            if why := refusal(values.get_all("Host"), values.get_all("Origin"), host):
                return connection.respond(403, f"{why}\n")
            return process_request(connection, request)

        used.append(host)
        return serve(*args, process_request=process, **options)

    opened.serve = checked
    try:
        yield
    finally:
        opened.serve = serve
    if not used:
        raise ValueError("this version of viser opens its page in a way that cannot be checked; accepted: viser 1.1")


class Viewer:
    """Shows frames to everyone who has the page open. Nothing here waits for a browser."""

    def __init__(self, server: Any, coloured: int | None = None) -> None:
        """Show as many vehicles as the first frame has.

        Args:
            server: the server from `serve`.
            coloured: number of vehicles that are not pale: the first ones. None: all.
        """
        self.server, self.count, self.coloured = server, 0, coloured
        self.followed, self.camera = 0, CAMERAS[0]
        self._scene = server.scene
        self._world = self._scene.add_frame("/world", show_axes=False)
        self._root = self._scene.add_frame("/world/task", show_axes=False)
        self._stage: Stage | None = None
        self._standing: Any = None
        self._moving: list[tuple[FacesBody, Any]] = []
        self._bodies: list[Any] = []
        self._rotors: Any = None
        self._goals: Any = None
        self._angle = np.zeros((1, 1))
        self._trail: deque[tuple[np.ndarray, float]] = deque(maxlen=TRAIL_POINTS + 1)
        self._line: Any = None
        self._load: Any = None
        self._cable: Any = None
        self._offset, self._placed = np.zeros(3), False

    def show(self, stage: Stage, origin: Float[np.ndarray, "3"], frame: StageFrame, elapsed: float) -> None:
        """Show a frame.

        Args:
            stage: the stage of the followed vehicle's world.
            origin: origin of that world in the frame's world, m.
            frame: the frame.
            elapsed: flight time since the last frame, s.
        """
        self.count = len(frame.position)
        with self.server.atomic():
            if stage is not self._stage:
                self._set(stage)
            self._root.position = tuple(map(float, origin))
            for body, node in self._moving:
                node.position = tuple(map(float, body.moved(frame.time)))
                node.visible = body.visible(frame.time)
            self._look(frame)
            self._fly(frame, elapsed)
            self._draw_trail(frame)

    def _set(self, stage: Stage) -> None:
        """Draw a stage."""
        new = self._stage is None or stage.vehicle is not self._stage.vehicle
        self._stage = stage
        if self._standing is not None:
            self._standing.remove()
        self._standing = self._scene.add_frame("/world/task/stage", show_axes=False)
        if stage.ground:
            self._scene.add_grid(
                "/world/task/stage/ground", 60.0, 60.0, cell_size=0.5, section_size=5.0, fade_distance=45.0,
                plane_color=_rgb(GROUND), plane_opacity=1.0, cell_color=_rgb(GRID),
                section_color=_rgb(GRID), position=(0.0, 0.0, -0.002),
            )  # fmt: skip
        self._moving = []
        still: dict[tuple[float, ...], list[np.ndarray]] = {}
        for i, body in enumerate(stage.bodies):
            if not body.moves:
                still.setdefault(tuple(body.colour.tolist()), []).append(body.quads)
            else:
                self._moving.append(
                    (body, self._mesh(f"/world/task/stage/moving_{i}", mesh_of(body.quads, body.colour)))
                )
        for i, (colour, quads) in enumerate(still.items()):
            self._mesh(f"/world/task/stage/solids_{i}", mesh_of(np.concatenate(quads), colour))
        for i, thing in enumerate(stage.things):
            self._thing(f"/world/task/stage/thing_{i}", thing)
        if new:
            self._make_vehicles(stage)

    def _make_vehicles(self, stage: Stage) -> None:
        shape = self._shape = quadrotor(stage.vehicle)
        self._bodies = [self._batch(f"/vehicles/body_{i}", mesh) for i, mesh in enumerate(shape.body)]
        self._rotors = self._batch("/vehicles/rotors", shape.rotor, len(shape.rotors))
        size = 0.25 * float(np.max(stage.vehicle.radius))
        self._goals = [
            self._scene.add_icosphere(f"/world/goals/goal_{i}", size, color=_rgb(GOAL), opacity=0.5, subdivisions=2)
            for i in range(self.count if self.count <= MANY else 1)
        ]

    def _batch(self, name: str, mesh: Mesh, each: int = 1) -> Any:
        """Add a mesh with `each` instances for each vehicle."""
        count = each * self.count
        colours = np.tile(_rgb(mesh.colour), (count + len(FAR_OFF), 1))
        if self.coloured is not None:
            colours[each * self.coloured :] = GHOST
        place, level = np.zeros((count, 3), np.float32), np.tile(LEVEL, (count, 1))
        return self._scene.add_batched_meshes_simple(
            name, mesh.vertices, mesh.faces, *_and_far_off(level, place), batched_colors=colours, lod="off",
            flat_shading=True, side="double",
        )  # fmt: skip

    def _mesh(self, name: str, mesh: Mesh) -> Any:
        return self._scene.add_mesh_simple(
            name, mesh.vertices, mesh.faces, color=_rgb(mesh.colour), flat_shading=True, side="double"
        )

    def _thing(self, name: str, thing: Line | Face | Mark) -> None:
        match thing:
            case Face():
                self._mesh(name, face(thing))
            case Line():
                points = np.asarray(thing.points, np.float32)
                pieces = np.stack([points[:-1], points[1:]], axis=1)
                self._scene.add_line_segments(
                    name, pieces, _rgb(rgb(thing.color)), thickness=2 * thing.width, thickness_units="screen"
                )
            case Mark():
                if thing.text:
                    place = tuple(map(float, thing.point))
                    self._scene.add_label(name, thing.text, position=place, anchor="center-center")

    def _fly(self, frame: StageFrame, elapsed: float) -> None:
        p = np.asarray(frame.position + self._offset, np.float32)
        q = np.asarray(frame.quaternion, np.float32)
        self._angle = (self._angle + self._shape.spin * frame.rotor_speed / SLOWEST * max(elapsed, 0.0)) % (2 * np.pi)
        places, attitudes = spun(self._shape, p, q, self._angle.astype(np.float32))
        for node in self._bodies:
            node.batched_wxyzs, node.batched_positions = _and_far_off(q, p)
        self._rotors.batched_wxyzs, self._rotors.batched_positions = _and_far_off(attitudes, places)
        rows = range(self.count) if self.count <= MANY else [self.followed]
        for node, row in zip(self._goals, rows, strict=True):
            known = frame.goal is not None and bool(np.isfinite(frame.goal[row]).all())
            if node.visible != known:
                node.visible = known
            if known and frame.goal is not None:
                node.position = tuple(map(float, frame.goal[row]))
        if frame.load is not None:
            self._hang(p[self.followed], np.asarray(frame.load[self.followed] + self._offset, np.float32))

    def _hang(self, vehicle: np.ndarray, load: np.ndarray) -> None:
        """Draw the followed vehicle's load, and its cable."""
        cable = np.stack([vehicle, load])[None]
        if self._load is None:
            self._load = self._scene.add_icosphere("/vehicles/load", LOAD, color=_rgb(GOAL), subdivisions=2)
            self._cable = self._scene.add_line_segments(
                "/vehicles/cable", cable, _rgb(GOAL), thickness=2.0, thickness_units="screen"
            )
        self._load.position, self._cable.points = tuple(map(float, load)), cable

    def _draw_trail(self, frame: StageFrame) -> None:
        if frame.fresh:
            self._trail.clear()
        here, speed = frame.position[self.followed].copy(), float(np.linalg.norm(frame.velocity[self.followed]))
        self._trail.append((here, speed))
        points = np.stack([place for place, _ in self._trail])
        points = np.concatenate([np.repeat(points[:1], TRAIL_POINTS + 1 - len(points), 0), points]).astype(np.float32)
        speeds = np.array([speed for _, speed in self._trail])
        speeds = np.concatenate([np.zeros(TRAIL_POINTS + 1 - len(speeds)), speeds])
        pieces, colours = np.stack([points[:-1], points[1:]], axis=1), coloured(speeds)
        colours = np.stack([colours[:-1], colours[1:]], axis=1)
        if self._line is None:
            self._line = self._scene.add_line_segments(
                "/world/trail", pieces, colours, thickness=3.0, thickness_units="screen"
            )
        else:
            self._line.points, self._line.colors = pieces, colours

    def follow(self, row: int) -> None:
        """Follow another vehicle."""
        self.followed = row
        self._trail.clear()

    def _look(self, frame: StageFrame) -> None:
        """Keep the followed vehicle in view. The world moves past the vehicle, so that users can still move their
        cameras.

        The vehicles are not a part of that world, because a busy browser draws its parts at different times.
        """
        here, q = frame.position[self.followed], frame.quaternion[self.followed]
        if self.camera != "orbit" or not self._placed:
            self._offset, self._placed = ANCHOR - here, True
            self._world.position = tuple(map(float, self._offset))
        if self.camera == "first person":
            for client in self.server.get_clients().values():
                with contextlib.suppress(AssertionError, ValueError):  # the browser has not reported its camera yet
                    _look_ahead(client.camera, ANCHOR, q)


def _look_ahead(camera: Any, here: np.ndarray, q: np.ndarray) -> None:
    ahead, up = rotate(q[None], np.eye(3)[[0, 2]])
    eye = here + NOSE * ahead
    camera.up_direction = up
    camera.position = eye
    camera.look_at = eye + ahead


def _and_far_off(attitude: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Attitudes and positions, with those of the instances that are never seen."""
    more = np.tile(LEVEL, (len(FAR_OFF), 1))
    return np.concatenate([attitude, more]), np.concatenate([place, FAR_OFF])


def coloured(speed: Float[np.ndarray, " n"]) -> np.ndarray:
    """Colours, (n, 3) uint8, of speeds, m/s: from blue at rest over green to yellow at the largest of the speeds."""
    share = np.asarray(speed, float) / max(float(np.max(speed, initial=0.0)), 0.5)
    stops = np.array([[68, 60, 140], [33, 145, 140], [94, 201, 98], [253, 200, 37]], float)
    at = share * (len(stops) - 1)
    low = np.minimum(at.astype(int), len(stops) - 2)
    part = (at - low)[:, None]
    return np.rint((1 - part) * stops[low] + part * stops[low + 1]).astype(np.uint8)


def _rgb(colour: Sequence[float]) -> tuple[int, int, int]:
    red, green, blue = (round(255 * float(x)) for x in colour)
    return red, green, blue
