"""What a window shows of a worker that an operator waits for: Blender's progress, a line in the status bar, a timer that looks at it."""

from ..scene.worker import BakeState

POLL_INTERVAL = 0.1  # s between looks at the worker
STEPS = 1000  # of Blender's own progress display


class WindowWork:
    """Mixed into a modal operator: _enter_window once, _show for each look, _leave_window when nothing is waited for any more."""

    def _enter_window(self, context):
        self._timer = context.window_manager.event_timer_add(POLL_INTERVAL, window=context.window)
        context.window_manager.progress_begin(0, STEPS)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _show(self, context, state: BakeState):
        context.window_manager.progress_update(int(state.fraction * STEPS))
        context.workspace.status_text_set(f"Reflect: {state.fraction:.0%}  {state.message}  (Esc cancels)")

    def _leave_window(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        if context.workspace:
            context.workspace.status_text_set(None)
