% A solver of your own, asked by penetrode: it reads one question a line and answers one a line, both in JSON.
%
%     penetrode diagnose "octave-cli peer.m"                         what is wrong?
%     penetrode verify --only peer/user --peer "octave-cli peer.m"   does it agree?
%
% It runs as it stands in Octave 7 and later. YOUR INTEGRATOR GOES INTO `solve_stage`; all below it is the protocol and
% may stay as it is. SI units throughout. In each stage, with x counted from the impact face,
%
%     dx/dt = V,    M dV/dt = -(p + s x + r V + q V^2),    until V = 0, the end of the stage or the exit depth.

1;  % a file of functions that does something in the end

% Flies through one stage from time t and y = [x; v], v > 0, until x = limit (may be Inf) or V = 0. Returns t, y there:
% x is `limit` itself where that was reached, and v is 0 where the projectile came to rest.
function [t, y] = solve_stage(mass, stage, limit, t, y, rtol, atol)
  p = stage.static_force_n; s = stage.stiffness_n_m; r = stage.viscosity_kg_s; q = stage.drag_kg_m;
  slope = @(y) [y(2); -(p + s * y(1) + (r + q * y(2)) * y(2)) / mass];
  first = slope(y);
  h = 0.01 * min((y(1) + atol(1) / rtol) / y(2), y(2) / abs(first(2)));
  for count = 1:100000
    [y1, last, err] = one_step(slope, y, first, h, rtol, atol);
    if err < 1000
      factor = min(5, 0.9 * max(err, 1e-9) ^ -0.2);
    else
      factor = 0.2;
    end
    if ! (err <= 1)
      h = h * factor;
      continue;
    end
    % A step over the turning point may begin and end before the limit and pass it twice: the turning point first.
    if y1(2) <= 0
      [h, y1] = shorten(slope, y, first, h, rtol, atol, @(y, slope) deal(y(2), slope(2)));
      if y1(1) < limit
        t = t + h; y = [y1(1); 0];
        return;
      end
    end
    if y1(1) >= limit
      [h, y1] = shorten(slope, y, first, h, rtol, atol, @(y, slope) deal(limit - y(1), -y(2)));
      t = t + h; y = [limit; max(y1(2), 0)];
      return;
    end
    t = t + h; y = y1; first = last; h = h * factor;
  end
  error("more than %d steps in a stage", count);
end

% From y on by h with the method of Dormand and Prince: y and its slope there, and the estimated error over the tolerance.
function [y1, last, err] = one_step(slope, y, first, h, rtol, atol)
  % A row for each evaluation after the first, the last at the new point.
  persistent rows = [1/5, 0, 0, 0, 0, 0;
                     3/40, 9/40, 0, 0, 0, 0;
                     44/45, -56/15, 32/9, 0, 0, 0;
                     19372/6561, -25360/2187, 64448/6561, -212/729, 0, 0;
                     9017/3168, -355/33, 46732/5247, 49/176, -5103/18656, 0;
                     35/384, 0, 500/1113, 125/192, -2187/6784, 11/84]';
  % What the new point has beyond that of order 4.
  persistent beyond = [71/57600; 0; -71/16695; 71/1920; -17253/339200; 22/525; -1/40];
  slopes = zeros(2, 7);
  slopes(:, 1) = first;
  for i = 1:6
    y1 = y + h * (slopes(:, 1:6) * rows(:, i));
    slopes(:, i + 1) = slope(y1);
  end
  last = slopes(:, 7);
  err = norm(h * (slopes * beyond) ./ (atol + rtol * abs(y1)), Inf);
end

% The step, h at most, at whose end a gap is closed that is open at its start: Newton within a bracket. `gap` gives the
% gap and its derivative in time.
function [h, y1] = shorten(slope, y, first, h, rtol, atol, gap)
  low = 0; high = h;
  for count = 1:100
    [y1, last] = one_step(slope, y, first, h, rtol, atol);
    [open_by, rate] = gap(y1, last);
    if open_by > 0
      low = h;
    else
      high = h;
    end
    change = -open_by / rate;
    if abs(change) <= 1e-16 * h || high - low <= 1e-16 * h
      break;
    end
    if low < h + change && h + change < high
      h = h + change;
    else
      h = 0.5 * (low + high);
    end
  end
end

% One flight: from stage to stage until rest or exit, every event on the way listed.
function text = solve(question)
  exit_depth = depth(question.exit_depth_m);
  t = 0; y = [0; question.velocity_m_s]; outcome = "stopped"; events = {};
  for index = 1:numel(question.stages)
    stage = question.stages(index);
    stage_end = depth(stage.end_m);
    limit = min(stage_end, exit_depth);
    if y(1) < limit && y(2) > 0
      [t, y] = solve_stage(question.mass_kg, stage, limit, t, y, question.rtol, question.atol);
    end
    if y(1) < limit
      break;
    end
    if stage_end <= exit_depth
      events{end + 1} = happened(sprintf("\"stage-end\", \"stage\": %d", index - 1), t, y);
    end
    if exit_depth <= stage_end
      events{end + 1} = happened("\"exit\"", t, y);
      outcome = "perforated";
      break;
    end
  end
  if y(2) == 0
    events{end + 1} = happened("\"rest\"", t, y);
  end
  text = sprintf("\"outcome\": \"%s\", %s, \"events\": [%s]", outcome, numbers(t, y), strjoin(events, ", "));
end

function text = happened(event, t, y)
  text = sprintf("{\"event\": %s, %s}", event, numbers(t, y));
end

function text = numbers(t, y)
  if ! all(isfinite([t; y]))
    error("the answer is not finite");
  end
  text = sprintf("\"time_s\": %.17g, \"depth_m\": %.17g, \"velocity_m_s\": %.17g", t, y(1), y(2));
end

function x = depth(x)  % null is [] here
  if isempty(x)
    x = Inf;
  end
end

% Who you are. A solver with steps of one size adds "fixed_step": true; each question then has the step to use,
% question.dt_s, and rtol and atol mean nothing. One that computes its forces itself adds "reads": "scene"; each question
% then has the physical scene, question.scene: mass_kg, diameter_m, strength_pa ...
hello = "{\"name\": \"my solver\", \"version\": \"1.0\", \"method\": \"Dormand-Prince 5(4)\"}";

while true
  try
    question = jsondecode(input("", "s"));  % fgetl would wait for a second line
  catch
    break;  % the end of the questions
  end
  if isfield(question, "hello")
    answer = hello;
  else
    try
      times = zeros(1, question.repeats);  % more than one only where `bench` measures the time
      for count = 1:question.repeats
        start = tic;
        flight = solve(question);
        times(count) = 1e9 * toc(start);
      end
      answer = sprintf("{\"id\": %d, %s, \"wall_ns\": %.0f}", question.id, flight, median(times));
    catch problem  % said in the answer; the next question may be solved
      answer = jsonencode(struct("id", question.id, "error", problem.message));
    end
  end
  printf("%s\n", answer);
  fflush(stdout);
end
