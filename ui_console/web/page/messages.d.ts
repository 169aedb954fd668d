// What the page and its server send each other. Written by tests/made_files; change the structs.

export interface Absence {
  name: string;
  since_s: number;
  cause: string;
  doing: string;
  remedy: string;
  vital: boolean;
  is_running: boolean;
  is_repeated: boolean;
  is_start: boolean;
}

export type AlarmKind =
  | "absent"
  | "battery"
  | "deadline"
  | "link"
  | "lost"
  | "no_answer"
  | "not_recorded"
  | "overload"
  | "rc_down"
  | "refused"
  | "stale_video"
  | "starving"
  | "stopped"
  | "taken"
  | "unsafe"
  | "visitor";

export interface AlarmView {
  key: string;
  kind: AlarmKind;
  severity: Severity;
  subject: string;
  line: string;
  remedy: string;
  first_s: number;
  last_s: number;
  count: number;
  is_active: boolean;
  acknowledged_by: string;
  while_away: boolean;
  where: string;
  robot: string;
  also: string[];
  keys: string[];
}

export interface ArcAbilities {
  reach: Reach | null;
  can_halt: boolean;
  commands: RoleCommand[];
  gives_pictures: boolean;
  kinds: KindChoice[];
}

export interface BodyView {
  name: string;
  is_robot: boolean;
  x_m: number;
  y_m: number;
  heading_rad: number;
  spread_m: number;
  source: string;
  is_stale: boolean;
  age_s: number;
  trail: number[];
  sees_rad: number;
  link: string;
  does: string;
}

export type Certainty =
  | "next"
  | "now"
  | "past";

export interface CommandForm {
  word: string;
  fields: FieldForm[];
  moves: boolean;
  roles: string[];
  doc: string;
}

export interface ComponentState {
  address: string;
  type: string;
  host: string;
  pid: number;
  state: LifeState;
  since_s: number;
  feedback: string;
  requester: string;
  absent: Absence[];
  stop: StandingStop | null;
  user: string;
  is_robot: boolean;
  start: number;
  stops: number;
}

export interface ConsentView {
  user: string;
  robot: string;
  why: string;
  left_s: number;
  others: number;
  topic: string;
  line: string;
  number: number;
}

export interface FieldForm {
  name: string;
  kind: ValueKind;
  unit: string;
  least: number;
  most: number;
  default: number | boolean | string;
  is_required: boolean;
  choices: string[];
  doc: string;
}

export interface FieldRow {
  name: string;
  text: string;
  number: number | null;
}

export interface FloorShape {
  name: string;
  kind: ShapeKind;
  x_m: number;
  y_m: number;
  width_m: number;
  depth_m: number;
  heading_rad: number;
}

export interface FloorView {
  width_m: number;
  depth_m: number;
  shapes: FloorShape[];
  image: string;
}

export interface FoundEvent {
  at_s: number;
  level: string;
  subject: string;
  what: string;
  person: string;
  where: string;
  cause: string;
  time: string;
}

export interface GaugeView {
  name: string;
  text: string;
  share: number;
  is_share: boolean;
  flag: boolean | null;
  span: string;
  doc: string;
}

export interface HealthView {
  word: string;
  lines: string[];
}

export interface KeyList {
  rows: KeyRow[];
  matching: number;
  heard: number;
  dropped: number;
}

export interface KeyRow {
  key: string;
  source: string;
  schema: string;
  messages_per_s: number;
  bytes_per_s: number;
  mean_bytes: number;
  heard_s: number;
}

export interface KindChoice {
  kind: string;
  title: string;
}

export type LifeState =
  | "connecting"
  | "draining"
  | "failed"
  | "ready"
  | "stopped";

export interface LinkView {
  name: string;
  is_up: boolean;
  latency_s: number;
  feedback: string;
}

export interface LogFound {
  number: number;
  first: number;
  events: FoundEvent[];
  total: number;
  left_out: number;
  since_s: number;
  asked_s: number;
}

export interface LogFoundAnswer {
  log: LogFound;
}

export interface LogRefused {
  number: number;
  code: string;
  refused: string;
  remedy: string;
}

export interface LogRefusedAnswer {
  log: LogRefused;
}

export interface LoggedEvent {
  at_s: number;
  level: string;
  subject: string;
  what: string;
  person: string;
  where: string;
  cause: string;
}

export interface LostView {
  robot: string;
  why: string;
  at_s: number;
  may_retake: boolean;
}

export interface Marker {
  at_s: number;
  kind: MarkerKind;
  name: string;
  line: string;
}

export type MarkerKind =
  | "alarm"
  | "grant"
  | "operator"
  | "revoked";

export interface MessageShown {
  number: number;
  stamp_s: number;
  sequence: number;
  cause: string;
  size_bytes: number;
  rows: FieldRow[];
  trouble: string;
  has_picture: boolean;
}

export type NodeState =
  | "failure"
  | "idle"
  | "lost"
  | "running"
  | "starting"
  | "success"
  | "waiting";

export interface NodeView {
  name: string;
  type: string;
  parent: string;
  depth: number;
  priority: number | null;
  state: NodeState;
  since_s: number;
  feedback: string;
  arc: string;
  because: string;
}

export type OrderKind =
  | "follow"
  | "go_to"
  | "return_home"
  | "watch_for_motion";

export type OrderState =
  | "done"
  | "ended"
  | "failed"
  | "running"
  | "starting"
  | "waiting";

export interface OrderView {
  robot: string;
  kind: OrderKind;
  number: number;
  words: string;
  state: OrderState;
  why: string;
  by: string;
  line: string;
  x_m: number;
  y_m: number;
  target: string;
}

export interface OwnView {
  console: string;
  user: string;
  robot: string;
  is_held: boolean;
  is_asked: boolean;
  status: string;
  epoch: number;
  until_s: number;
  taken_because: string;
  applied: string;
  stop: StopView | null;
  away_since_s: number;
  consent: ConsentView | null;
  asked: string;
  other_screens: string[];
  must_let_go: boolean;
  lost: LostView | null;
  link_down_s: number;
  moment: number;
  orders: OrderView[];
  is_unsure: boolean;
}

export interface ParameterView {
  component: string;
  address: string;
  name: string;
  value: string;
  before: string;
  changed_by: string;
  changed_s: number;
}

export interface ParametersAnswer {
  parameters: string;
  told: boolean;
}

export interface PlaybackView {
  begin_s: number;
  end_s: number;
  at_s: number;
  is_playing: boolean;
  speed: number;
}

export interface Reach {
  forward_m_s: number;
  turn_rad_s: number;
}

export interface RefusedAnswer {
  refused: string;
}

export type RequestState =
  | "connecting"
  | "idle"
  | "revoking"
  | "running"
  | "waiting";

export interface RequestView {
  arc: string;
  owner: string;
  state: RequestState;
  rcs: string[];
  since_s: number;
  until_s: number;
  expected_start_s: number;
  because: string;
  blockers: string[];
  minimum_runtime_s: number;
  priority: string;
  turns: number;
  rule: string;
  would_change: string;
  raised: number;
}

export interface RobotView {
  robot: string;
  number: number;
  is_up: boolean;
  waiting: string[];
  stop: StopView | null;
  feedback: string;
  holder: string;
  arc: string;
  is_console: boolean;
  is_mine: boolean;
  priority: string;
  epoch: number;
  since_s: number;
  until_s: number;
  lease_left_s: number;
  lease_age_s: number;
  because: string;
  video: VideoView | null;
  gauges: GaugeView[];
  reported_age_s: number;
}

export interface RoleCommand {
  role: string;
  title: string;
  form: CommandForm;
  labels: string[];
}

export interface SeenViews {
  behavior: string;
  views: ViewRow[];
  trouble: string;
}

export interface SetAnswer {
  set: string;
  parameter: string;
  done: boolean;
}

export type Severity =
  | "alarm"
  | "notice"
  | "warning";

export type ShapeKind =
  | "dark"
  | "furniture"
  | "landmark"
  | "ramp"
  | "wall";

export interface SliceView {
  who: string;
  arc: string;
  epoch: number;
  from_s: number;
  to_s: number;
  certainty: Certainty;
  is_console: boolean;
}

export interface StandingStop {
  number: number;
  by: string;
  reason: string;
  since_s: number;
  is_confirmed: boolean;
  authors: Stopper[];
}

export interface StopView {
  number: number;
  reason: string;
  age_s: number;
  is_confirmed: boolean;
  by_user: string;
  also: string[];
  is_mine: boolean;
  lift_line: string;
}

export interface Stopper {
  by: string;
  console: string;
}

export interface TimelineRow {
  rc: string;
  kind: string;
  is_sharable: boolean;
  slices: SliceView[];
}

export interface TimelineView {
  from_s: number;
  now_s: number;
  to_s: number;
  rows: TimelineRow[];
}

export type ValueKind =
  | "flag"
  | "number"
  | "other"
  | "text"
  | "whole";

export interface VideoView {
  robot: string;
  age_s: number;
  rate_hz: number;
  latency_s: number;
  is_stale: boolean;
}

export interface View {
  welcome: Welcomed;
  own: OwnView;
  abilities: ArcAbilities | null;
  robots: RobotView[];
  links: LinkView[];
  alarms: AlarmView[];
  drawn: Record<string, number>;
  tree: NodeView[];
  requests: RequestView[];
  timeline: TimelineView;
  health: HealthView | null;
  parameters: ParameterView[];
  components: ComponentState[];
  log: LoggedEvent[];
  floor: FloorView | null;
  bodies: BodyView[];
  now_s: number;
  seen: SeenViews;
  beat: number;
  playback: PlaybackView;
  markers: Marker[];
}

export interface ViewRow {
  view: string;
  is_picture: boolean;
  text: string;
}

export interface Welcomed {
  user: string;
  priority: number;
  mission: string;
  missions: string[];
}

export interface WhyAnswer {
  why: string;
  lines: string[];
}

export interface Acknowledge {
  do: "acknowledge";
  key?: string;
}

export interface BeatRequest {
  do: "beat";
  number: number;
}

export interface Decide {
  do: "decide";
  is_given: boolean;
  number: number;
}

export interface DismissLost {
  do: "dismiss_lost";
}

export interface Drawn {
  do: "drawn";
  robot: string;
  number: number;
}

export interface EndOrders {
  do: "end_orders";
  robots: string[];
}

export interface GiveRequest {
  do: "give";
  moment: number;
  word: string;
  values: Record<string, number | number | boolean | string>;
  role: string;
}

export interface Hello {
  do: "hello";
  token: string;
  user?: string;
  priority?: number | null;
  page?: string;
}

export interface Here {
  do: "here";
  is_there: boolean;
}

export type KeyOrder =
  | "bytes"
  | "key";

export interface LiftRequest {
  do: "lift";
  robot: string;
  number: number;
}

export interface ListKeys {
  do: "list_keys";
  is_open: boolean;
  words?: string;
  order?: KeyOrder;
}

export interface LookInto {
  do: "look";
  behavior?: string;
  view?: string;
}

export interface MayI {
  do: "may_i";
  why?: string;
}

export interface MoreLog {
  do: "more_log";
  number: number;
  first: number;
}

export interface OrderRequest {
  do: "order";
  moment: number;
  kind: OrderKind;
  robots: string[];
  x_m?: number;
  y_m?: number;
  target?: string;
}

export interface ParametersRequest {
  do: "parameters";
  name: string;
}

export interface PictureOrder {
  do: "order_in_picture";
  moment: number;
  robot: string;
  robots: string[];
  column_px: number;
  row_px: number;
  width_px: number;
  height_px: number;
}

export interface PlayOn {
  do: "play_on";
  speed?: number;
}

export interface ReleaseRequest {
  do: "release";
}

export interface SearchLog {
  do: "search_log";
  text?: string;
  robot?: string;
  person?: string;
  level?: string;
  since?: string;
  until?: string;
  number: number;
}

export interface SetRequest {
  do: "set";
  name: string;
  parameter: string;
  value: unknown;
}

export interface ShowTime {
  do: "go_to";
  at_s: number;
}

export interface StandStill {
  do: "pause";
}

export interface Steer {
  do: "drive";
  moment: number;
  forward: number;
  right: number;
  speed: number;
}

export interface StepOn {
  do: "step_on";
}

export interface StopAllRequest {
  do: "stop_all";
}

export interface StopRequest {
  do: "stop_robot";
  robot: string;
}

export interface StopWheels {
  do: "stop";
}

export interface TakeOver {
  do: "take";
  robot: string;
  kind?: string;
}

export interface ViewKey {
  do: "view_key";
  number: number;
  key?: string;
  source?: string;
  schema?: string;
}

export interface Watch {
  do: "watch";
  robots: string[];
}

export interface WhyRequest {
  do: "why";
  name: string;
}

export type Answer =
  | WhyAnswer
  | RefusedAnswer
  | ParametersAnswer
  | SetAnswer
  | LogFoundAnswer
  | LogRefusedAnswer;

export type Heard = { view: Partial<View>; answer?: undefined } | { answer: Answer; view?: undefined };

export type Said =
  | Hello
  | BeatRequest
  | Steer
  | StopWheels
  | GiveRequest
  | OrderRequest
  | PictureOrder
  | EndOrders
  | TakeOver
  | ReleaseRequest
  | MayI
  | Decide
  | DismissLost
  | StopRequest
  | StopAllRequest
  | LiftRequest
  | Watch
  | Drawn
  | LookInto
  | ListKeys
  | ViewKey
  | WhyRequest
  | SearchLog
  | MoreLog
  | Acknowledge
  | ParametersRequest
  | SetRequest
  | Here
  | PlayOn
  | StandStill
  | StepOn
  | ShowTime;
