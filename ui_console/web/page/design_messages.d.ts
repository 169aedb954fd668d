// What the page and its server send each other. Written by tests/made_files; change the structs.

export interface AskAnswer {
  ask: OfferView;
  path: number[];
}

export interface DesignView {
  welcome: DesignerWelcomed;
  tree: ElementRow[];
  problems: ProblemRow[];
  palette: PaletteRow[];
  places: Record<string, string[]>;
  status: DraftStatus;
  selected: number;
  element: ElementView;
  rehearsal: RehearsalView | null;
  people: string[];
  handled: number;
  beat: number;
}

export interface DesignerWelcomed {
  user: string;
}

export interface DraftStatus {
  source: string;
  revision: number;
  is_changed: boolean;
  is_new: boolean;
  problems: number;
  can_undo: boolean;
  can_redo: boolean;
  changed_by: string;
}

export interface ElementRow {
  path: number[];
  tag: string;
  told: string;
  problems: string[];
}

export interface ElementView {
  path: number[];
  tag: string;
  told: string;
  line: number;
  doc: string;
  type_doc: string[];
  properties: Property[];
  offers: OfferView[];
}

export interface FileChangedAnswer {
  file_changed: string;
  name: string;
}

export interface NoticeAnswer {
  notice: string;
  remedy: string;
}

export interface OfferView {
  label: string;
  doc: string;
  asks: Prompt[];
}

export interface PaletteRow {
  label: string;
  group: string;
  name: string;
  tag: string;
  type: string;
  is_known: boolean;
  doc: string[];
}

export interface ProblemRow {
  line: number;
  column: number;
  message: string;
  remedy: string;
  path: number[];
}

export interface Prompt {
  name: string;
  doc: string;
  proposed: string;
  choices: string[];
  is_required: boolean;
}

export interface Property {
  name: string;
  value: string | null;
  default: string | null;
  is_missing: boolean;
  is_parameter: boolean;
  doc: string;
  choices: string[];
}

export interface RefusalAnswer {
  refused: string;
  remedy: string;
  is_change: boolean;
}

export interface RehearsalRow {
  name: string;
  is_arc: boolean;
  turns: TurnView[];
}

export interface RehearsalView {
  end_s: number;
  rows: RehearsalRow[];
  told: string[];
  never: string[];
}

export interface SavedAnswer {
  saved: string;
  problems: number;
}

export interface TextAnswer {
  text: string;
  line: number;
  source: string;
}

export interface TurnView {
  from_s: number;
  open_s: number;
  to_s: number;
  who: string;
}

export interface BeatRequest {
  do: "beat";
  number: number;
}

export interface Hello {
  do: "hello";
  token: string;
  user?: string;
  priority?: number | null;
  page?: string;
}

export interface LookUp {
  do: "look_up";
  type: string;
}

export interface MoveElement {
  do: "move";
  revision: number;
  path: number[];
  parent: number[];
  before?: number | null;
}

export interface ReadText {
  do: "text";
}

export interface Redo {
  do: "redo";
  revision: number;
}

export interface Rehearse {
  do: "rehearse";
  is_shown: boolean;
}

export interface RemoveElement {
  do: "remove";
  revision: number;
  path: number[];
}

export interface SaveFile {
  do: "save";
  revision: number;
  name?: string;
  overwrite?: boolean;
}

export interface Select {
  do: "select";
  path: number[];
  number?: number;
}

export interface SetProperty {
  do: "set";
  revision: number;
  path: number[];
  name: string;
  value: string;
  is_parameter?: boolean;
}

export interface TakeFile {
  do: "reread";
  revision: number;
}

export interface TakeOffer {
  do: "take";
  revision: number;
  path: number[];
  label: string;
  answers?: string[];
}

export interface Undo {
  do: "undo";
  revision: number;
}

export type Answer =
  | AskAnswer
  | RefusalAnswer
  | FileChangedAnswer
  | NoticeAnswer
  | SavedAnswer
  | TextAnswer;

export type Heard = { view: Partial<DesignView>; answer?: undefined } | { answer: Answer; view?: undefined };

export type Said =
  | Hello
  | BeatRequest
  | Select
  | TakeOffer
  | SetProperty
  | MoveElement
  | RemoveElement
  | Undo
  | Redo
  | SaveFile
  | TakeFile
  | Rehearse
  | LookUp
  | ReadText;
